"""Force sensor adapter for ATI's Net F/T driver: connection and sample validity."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

from typing_extensions import override

from palpate.adapters.config import SensorFactsTable
from palpate.adapters.hardware.plugins import Host, RigContext
from palpate.adapters.hardware.polled_sensor import PolledForceSensor, SensorTable
from palpate.core.ports import Clock, Range
from palpate.drivers.ati import RDT_PORT, NetFt, NetFtBox, UdpWire, read_box

_PAGE_S = 3.0


@dataclass(frozen=True)
class NetFtTable(SensorTable):
    """Settings for a Net F/T in a rig file."""

    host: Host = "192.168.1.1"
    """Address of the box."""
    port: Annotated[int, Range(1, 65535)] = RDT_PORT
    """UDP port of the box."""
    http_port: Annotated[int, Range(1, 65535)] = 80
    """Port of the box's web server."""


class NetFtForceSensor(PolledForceSensor[NetFt]):
    """A wrist sensor connected to a Net F/T box. Its frame is that of the box."""

    REMEDY = "end other programs that ask the box for its stream, and let UDP through this computer's firewall"

    def __init__(
        self, table: NetFtTable, clock: Clock, open_box: Callable[[NetFtTable], tuple[UdpWire, NetFtBox]]
    ) -> None:
        super().__init__("ATI Net F/T", clock, table)
        self._table, self._open_box = table, open_box

    @property
    @override
    def period_ns(self) -> int:
        return round(1e9 / self.opened().box.rate_Hz)

    def reported_facts(self) -> SensorFactsTable:
        """Return the rated ranges and the rate that the box reports. It does not report its noise."""
        box = self.opened().box
        return SensorFactsTable(range_N=box.range_N, range_Nm=box.range_Nm, rate_Hz=box.rate_Hz, frame="sensor")

    def _connect(self) -> None:
        wire, box = self._open_box(self._table)
        self._close_wire, self.device = wire.close, NetFt(wire, box)

    def _on_activate(self) -> None:
        self.opened().start(self._clock.now_ns())
        super()._on_activate()

    def _on_deactivate(self) -> None:
        self.opened().stop()

    def _leave(self, device: NetFt) -> None:
        device.stop()


def make_ati_netft(table: NetFtTable, context: RigContext) -> NetFtForceSensor:
    """Return a Net F/T from the ``[force_sensor]`` table of a rig file."""
    return NetFtForceSensor(table, context.clock, _open_box)


def _open_box(table: NetFtTable) -> tuple[UdpWire, NetFtBox]:
    wire = UdpWire(table.host, table.port)
    try:
        return wire, read_box(wire.address, table.http_port, _PAGE_S)
    except BaseException:
        wire.close()
        raise
