"""A clock port with faults."""

from collections.abc import Sequence
from typing import Final

from typing_extensions import override

from palpate.adapters.fault_injection.plan import FaultPlan
from palpate.adapters.fault_injection.schedule import FaultAccount, FaultDelivery, FaultMoment, Notify, Schedule
from palpate.core.ports import Clock

_NS: Final = 1_000_000_000


class FaultyClock(Clock):
    """A clock with faults. A sleep begins a tick; faults come at its end.

    A jump backwards is what the contract of the port forbids: instead, the clock stands still until time has caught up.

    Args:
        notify: Called with each delivery; times are those of ``clock``.

    Raises:
        ConfigurationError: A plan is for another port.
    """

    def __init__(self, clock: Clock, plans: Sequence[FaultPlan], notify: Notify | None = None) -> None:
        self._clock, self._account = clock, FaultAccount(notify)
        self._schedules = self._account.schedules("clock", plans)
        self._tick = -1
        self._offset_ns = 0
        self._floor_ns: int | None = None
        self._jumped: set[int] = set()

    @property
    def deliveries(self) -> list[FaultDelivery]:
        """What was delivered so far."""
        return self._account.deliveries

    @override
    def now_ns(self) -> int:
        shown_ns = self._clock.now_ns() + self._offset_ns
        if self._floor_ns is not None:
            shown_ns = max(shown_ns, self._floor_ns)
        self._floor_ns = shown_ns
        return shown_ns

    @override
    def sleep_until(self, deadline_ns: int) -> None:
        if not self._schedules:
            self._clock.sleep_until(deadline_ns)
            return
        if self.now_ns() < deadline_ns:
            self._clock.sleep_until(deadline_ns - self._offset_ns)
        self._tick += 1
        moment = FaultMoment(self._tick, self._clock.now_ns())
        for number, schedule in enumerate(self._schedules):
            strikes = schedule.strikes(moment)
            if schedule.plan.kind == "clock-jump":
                self._jump(number, schedule, moment, strikes)
            elif strikes:
                self._clock.sleep_until(self._clock.now_ns() + round(schedule.plan.time_s * _NS))
                schedule.delivered(moment)

    def _jump(self, number: int, schedule: Schedule, moment: FaultMoment, strikes: bool) -> None:
        if strikes == (number in self._jumped):
            return
        self._jumped ^= {number}
        # The present time is shown first, so that none later can be before it.
        self.now_ns()
        jump_ns = round(schedule.plan.time_s * _NS) * (1 if strikes else -1)
        self._offset_ns += jump_ns
        back = ", which a clock may not: it stands still until then" if jump_ns < 0 else ""
        schedule.report(moment, f"time jumps by {jump_ns / _NS:+g} s{back}")
