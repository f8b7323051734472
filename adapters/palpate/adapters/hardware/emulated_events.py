"""Timed faults in emulated devices, for practising how to respond to them."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Self

from palpate.core.errors import ConfigurationError

EVENTS: Final = {
    "protective-stop": "the controller stops the arm, as at a collision",
    "emergency-stop": "the emergency stop is pressed; the drives lose their power",
    "program-end": "the control program is ended at the pendant",
    "cable-pulled": "the cable between this computer and the arm is pulled",
    "sensor-silent": "the force sensor stops sending",
    "sensor-cable": "the cable between the force sensor and its electronics is pulled",
}
"""All events. A rig supports those that its devices can produce."""
_EVENT: Final = re.compile(r"(start\+)?(\d+(?:\.\d+)?)s:([a-z-]+)")
_NS: Final = 1_000_000_000


@dataclass(frozen=True)
class PlannedEvent:
    """A planned event, timed from the start of the devices or from the first motion of the arm."""

    name: str
    after_s: float
    from_start: bool

    @classmethod
    def of(cls, text: str, possible: Iterable[str]) -> Self:
        """Parse an event in the format of the ``--event`` option.

        Raises:
            ConfigurationError: The text is not an event, or these devices do not support it.
        """
        found, names = _EVENT.fullmatch(text), [name for name in EVENTS if name in possible]
        if found is None or found[3] not in EVENTS:
            accepted = (
                f"a time and an event, such as 12s:{names[0]} or start+12s:{names[0]}, with one of {', '.join(names)}"
            )
            raise ConfigurationError("event", text, accepted)
        if found[3] not in names:
            raise ConfigurationError("event", text, f"one of {', '.join(names)}, which these devices can show")
        return cls(found[3], float(found[2]), bool(found[1]))

    def due(self, now_ns: int, begun_ns: int, moved_ns: int) -> bool:
        """Return True if the event is due; ``moved_ns`` is the time of the arm's first motion, 0 until then."""
        from_ns = begun_ns if self.from_start else moved_ns
        return bool(from_ns) and now_ns >= from_ns + self.after_s * _NS
