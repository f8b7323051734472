"""Force sensor adapter for the JR3 driver: connection and sample validity."""

from dataclasses import dataclass
from typing import Annotated, Any, Final

from can import BusABC
from typing_extensions import override

from palpate.adapters.config import SensorFactsTable
from palpate.adapters.hardware.can_table import CanBusTable
from palpate.adapters.hardware.plugins import RigContext
from palpate.adapters.hardware.polled_sensor import PolledForceSensor, SensorTable
from palpate.core.ports import Clock, OneOf, Range
from palpate.drivers.can import CanLink, open_bus
from palpate.drivers.jr3 import LEFT_HANDED, RIGHT_HANDED, Jr3, shut_down, start_up

_NAME: Final = "JR3"
_LEAVE_S: Final = 5.0
"""Maximum time to wait for a board to stop its stream."""
_DEAD_S: Final = 0.2
"""The same limit for a failed board, which may not answer the request."""


@dataclass(frozen=True)
class Jr3CanTable(CanBusTable, SensorTable):
    """Settings for a JR3 on CAN in a rig file."""

    node: Annotated[int, Range(1, 127)] = 1
    """The board's node number."""
    canopen_nodes: tuple[int, ...] = ()
    """CANopen nodes of the drives on the same bus."""
    cutoff_Hz: Annotated[float, Range(0.0, 655.35)] = 50.0
    """Cut-off of the board's filter, in steps of 0.01; 0 disables the filter."""
    period_us: Annotated[int, Range(540, 1_000_000)] = 5000
    """Time between readings; the minimum leaves half of the bus capacity free."""
    axes: Annotated[str, OneOf("left-handed", "right-handed")] = "left-handed"
    """Handedness of the sensor's axes."""
    start_timeout_s: Annotated[float, Range(0.1, 600.0)] = 30.0

    @override
    def check(self) -> None:
        super().check()
        # All identifiers of board and drives are multiples of 0x80 plus the node number. With equal numbers, the
        # drive's frames would be read as readings and commands, and its TPDO2 would stop the sensor.
        self.require("node", self.node not in self.canopen_nodes, "a node that no drive on the bus has")


class Jr3ForceSensor(PolledForceSensor[Jr3]):
    """A JR3 wrist sensor."""

    REMEDY = "choose a higher cut-off, or look at it"

    def __init__(self, table: Jr3CanTable, clock: Clock) -> None:
        super().__init__(_NAME, clock, table)
        self._table = table

    @property
    @override
    def period_ns(self) -> int:
        return self._table.period_us * 1000

    def reported_facts(self) -> SensorFactsTable:
        """Return the full-scale ranges and the rate that the board reports. It does not report its noise."""
        scales = self.opened().full_scales
        x, y, z = scales.force_N
        tx, ty, tz = scales.moment_dNm
        return SensorFactsTable(
            range_N=(float(x), float(y), float(z)),
            range_Nm=(tx / 10, ty / 10, tz / 10),
            rate_Hz=1e6 / self._table.period_us,
            frame="sensor",
        )

    def _surprise(self, device: Jr3) -> str | None:
        return "the board restarted, so readings may have jumped; check its supply" if device.after_boot else None

    def _connect(self) -> None:
        table, bus = self._table, open_jr3_bus(self._table)
        self._close_wire = bus.shutdown
        self.device = Jr3(
            CanLink(bus),
            table.node,
            cutoff_Hz=table.cutoff_Hz,
            period_us=table.period_us,
            signs=LEFT_HANDED if table.axes == "left-handed" else RIGHT_HANDED,
        )
        start_up(self.device, self._clock.now_ns, self._sleep, self._start_timeout_s)

    def _leave(self, device: Jr3) -> None:
        wait_s = _LEAVE_S if self._is_sound(device) else _DEAD_S
        shut_down(device, self._clock.now_ns, self._sleep, wait_s)


def make_jr3_can(table: Jr3CanTable, context: RigContext) -> Jr3ForceSensor:
    """Return a JR3 on CAN from the ``[force_sensor]`` table of a rig file."""
    return Jr3ForceSensor(table, context.clock)


def open_jr3_bus(table: Jr3CanTable) -> BusABC:
    """Open the bus."""
    # The driver only polls for received frames; slcan would wait a millisecond for them.
    extra: dict[str, Any] = {"timeout": 0.0} if table.bus["interface"] == "slcan" else {}
    return open_bus(**(extra | table.bus))
