"""Which error it is when the board does not do as asked: whose fault, and what to do."""

from __future__ import annotations

from palpate.drivers.errors import DeviceFaultError, DriverError, GarbledError, SilentError, WiringError
from palpate.drivers.jr3.transport import WireCounts


def no_answer(name: str, doing: str, counts: WireCounts, *, refused: bool, heard: bool) -> DriverError:
    """A request has not been answered as often as it may be made.

    Args:
        name: The sensor, as a person would call it.
        doing: What the request was for.
        counts: What the wire has seen.
        refused: The board answered that it is not initialised.
        heard: The board was heard since it was opened.
    """
    if refused:
        remedy = "check the cable between sensor and board, then power the board again"
        return DeviceFaultError(name, "the board says that its sensor is not initialised", remedy)
    if heard:
        return SilentError(name, f"no answer while {doing}", "check cable and power; then open it again")
    if counts.good == 0 and counts.garbage > 0:
        remedy = "check that it is the right port, at 115200 baud 8N1 or 1 Mbit/s"
        return GarbledError(name, f"nothing but {_garbage(counts)}", remedy)
    remedy = "check power, wiring, bit rate, and on CAN the node number and the termination"
    return WiringError(name, f"nobody answers ({_garbage(counts)})", remedy)


def no_reading(name: str, stall_ns: int, counts: WireCounts) -> SilentError:
    """The stream has stopped."""
    problem = f"no new reading for {stall_ns * 1e-6:.0f} ms ({_garbage(counts)})"
    return SilentError(name, problem, "check cable and power; then open it again")


def too_many_boots(name: str, boots: int) -> DeviceFaultError:
    """The board restarts before it gives a reading."""
    problem = f"has restarted {boots} times without a reading between"
    return DeviceFaultError(name, problem, "check its supply voltage and its cable")


def _garbage(counts: WireCounts) -> str:
    offs = f", {counts.bus_offs} bus-offs" if counts.bus_offs else ""
    return f"{counts.garbage} frames or bytes without sense{offs}"
