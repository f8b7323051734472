"""The contract for the :class:`palpate.core.ports.devices.Clock` port, and a virtual-time clock for tests."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Final

from palpate.adapters.contracts.bench import require
from palpate.core.ports import CONTROL_RATE_HZ, Clock

TICK_NS: Final = 10**9 // CONTROL_RATE_HZ
"""Control loop period in ns."""

_READS: Final = 5000


@dataclass(frozen=True, kw_only=True)
class ClockRig:
    """A clock on the test bench.

    Attributes:
        tolerance_ns: Permitted delay of ``sleep_until``; 0 for virtual time.
        step_ns: Duration of a sleep that is long compared with the tolerance.
        deadlines: Number of successive deadlines to test.
    """

    clock: Clock
    tolerance_ns: int = 0
    step_ns: int = 5_000_000
    deadlines: int = 250


class ClockContract(ABC):
    """Clauses for every clock; a subclass supplies the rig."""

    @abstractmethod
    def make(self) -> ClockRig:
        """Return a new rig."""

    def test_time_is_integer_nanoseconds_and_never_goes_back(self) -> None:
        """The time is an int in ns and never decreases."""
        clock = self.make().clock
        last_ns = clock.now_ns()
        for _ in range(_READS):
            now_ns = clock.now_ns()
            require("type", type(now_ns) is int, f"now_ns() = {now_ns!r}", "an int, in ns")
            require("order", now_ns >= last_ns, f"{now_ns} ns after {last_ns} ns", "no way back")
            last_ns = now_ns

    def test_past_deadline_returns_at_once(self) -> None:
        """With a deadline in the past, ``sleep_until`` returns immediately and does not set the clock back."""
        rig = self.make()
        before_ns = rig.clock.now_ns()
        rig.clock.sleep_until(before_ns - rig.step_ns)
        passed_ns = rig.clock.now_ns() - before_ns
        at_once = 0 <= passed_ns <= 2 * rig.tolerance_ns
        require("past deadline", at_once, f"{passed_ns} ns went by", f"at most {2 * rig.tolerance_ns} ns")

    def test_absolute_deadlines_do_not_drift(self) -> None:
        """In a long sequence of absolute deadlines, the last one is met as accurately as the first."""
        rig = self.make()
        deadline_ns = rig.clock.now_ns()
        for count in range(1, rig.deadlines + 1):
            # An odd number of ns reveals clocks with a coarser resolution.
            deadline_ns += rig.step_ns + 1 if count % 2 else rig.step_ns // 50
            rig.clock.sleep_until(deadline_ns)
            late_ns = rig.clock.now_ns() - deadline_ns
            on_time = 0 <= late_ns <= rig.tolerance_ns
            require("drift", on_time, f"{late_ns} ns late at deadline {count}", f"0 to {rig.tolerance_ns} ns")


class FakeClock(Clock):
    """Virtual clock, on which a sleep returns immediately."""

    def __init__(self, start_ns: int = 0) -> None:
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """Return the current time."""
        return self._now_ns

    def sleep_until(self, deadline_ns: int) -> None:
        """Advance the clock to the deadline, unless it has passed."""
        self._now_ns = max(self._now_ns, deadline_ns)

    def advance(self, ticks: int = 1) -> None:
        """Advance the clock by ``ticks`` control ticks."""
        self._now_ns += ticks * TICK_NS
