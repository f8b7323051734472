"""CAN bus settings for a device in a rig file."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeAlias

from typing_extensions import override

from palpate.core.ports import Range, Settings, fitted

_BitRate: TypeAlias = Annotated[int, Range(1, 1_000_000)]


@dataclass(frozen=True)
class CanBusTable(Settings):
    """Settings that all CAN devices share."""

    interface: str = "socketcan"
    """CAN interface type, as named in python-can."""
    channel: str = "can0"
    """Channel name."""
    bitrate: _BitRate = 1_000_000
    """Bit rate in bits per second."""
    can: Mapping[str, Any] = field(default_factory=dict)
    """Further python-can options for this interface, passed unchanged; they override the three settings above."""

    @override
    def check(self) -> None:
        for name, kind in (("interface", str), ("bitrate", _BitRate)):
            fitted(f"{self.TABLE}.can.{name}", self.bus[name], kind)

    @property
    def bus(self) -> dict[str, Any]:
        """Return the arguments for python-can."""
        return {"interface": self.interface, "channel": self.channel, "bitrate": self.bitrate, **self.can}
