"""Which error it is when the board does not do as asked, and what to do about it."""

from collections.abc import Mapping
from typing import Final

from palpate.drivers.device import listed
from palpate.drivers.errors import DeviceFaultError, DriverError, GarbledError, SilentError, WiringError
from palpate.drivers.jr3.messages import TransportCounts


def no_answer(name: str, doing: str, counts: TransportCounts, *, refused: bool, heard: bool) -> DriverError:
    """A request has not been answered as often as it may be made."""
    if refused:
        remedy = "check the cable between sensor and board, then power the board again"
        return DeviceFaultError(name, "the board says that its sensor is not initialised", remedy)
    if heard:
        return SilentError(name, f"no answer while {doing}", "check cable and power; then open it again")
    if counts.good == 0 and counts.garbage > 0:
        remedy = "check that it is the right port, at 1 Mbit/s"
        return GarbledError(name, f"nothing but {_garbage(counts)}", remedy)
    remedy = "check power, wiring, bit rate, node number and termination"
    return WiringError(name, f"no answer ({_garbage(counts)})", remedy)


_SHIELD: Final = "check shield, ground and bit rate; then open it again"
_OTHERS: Final = "see what else talks to the board, and whether the line loses frames; then open it again"
REMEDIES: Final = {
    "repeated readings": "see that the sensor is plugged into its board, then power the board again",
    "frames without sense or cut short": _SHIELD,
    "halves of readings without the other half": _SHIELD,
    "readings whose counter jumped": _OTHERS,
    "counters that began again": _OTHERS,
    "readings at or near the end of the scale": "see what presses on the tool, then the cable between sensor and board",
    "answers without a request": _OTHERS,
}
"""What is counted besides good readings, the most telling first, and what to do about it."""


def no_reading(name: str, silent_ns: int, came: Mapping[str, int]) -> SilentError:
    """The stream has stopped, or what comes is no news."""
    what = f"{listed(came)} came instead" if came else "nothing comes"
    remedy = next((REMEDIES[count] for count in REMEDIES if count in came), "check cable and power; then open it again")
    return SilentError(name, f"no new reading for {silent_ns * 1e-6:.0f} ms: {what}", remedy)


def too_many_boots(name: str, boots: int) -> DeviceFaultError:
    """The board restarts before it gives a reading."""
    problem = f"has restarted {boots} times without a reading between"
    return DeviceFaultError(name, problem, "check its supply voltage and its cable")


def _garbage(counts: TransportCounts) -> str:
    offs = f", {counts.bus_offs} bus-offs" if counts.bus_offs else ""
    return f"{counts.garbage} frames without sense{offs}"
