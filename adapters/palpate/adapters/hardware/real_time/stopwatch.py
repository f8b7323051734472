"""Times the sections of every tick, in memory that never grows."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Final

import numpy as np

from palpate.adapters.hardware.real_time.attribution import Account, Attribution, Cause, ThreadAccount, attribute
from palpate.adapters.hardware.real_time.lateness import Histograms, LatenessSpread, LateTick, Limits, SlowCore
from palpate.adapters.hardware.real_time.sections import BUSY, COLUMNS, CORE, LATE, TickSection
from palpate.core.errors import DeviceError
from palpate.core.ports.values import CONTROL_RATE_HZ

_NS: Final = 1_000_000_000
_BATCH: Final = 256
"""Ticks that are taken over into the distributions at once: one by one that would cost several times as much."""
_KEPT: Final = 256
"""The newest ticks of which is kept that they were late."""
_NEVER_NS: Final = 1 << 62
_CLOCK, _FORCE, _JOINTS, _SEND, _RECORD = (
    int(section)
    for section in (TickSection.CLOCK, TickSection.FORCE, TickSection.JOINTS, TickSection.SEND, TickSection.RECORD)
)
_INNER: Final = [_CLOCK, _FORCE, _JOINTS, _SEND]
"""What a recorder's decorators hold inside."""
_CLAIMED: Final = [int(section) for section in (*CORE, TickSection.RECORD)]
"""What remains of a tick after these and the ports is the rest."""
_NOTHING: Final = (0,) * COLUMNS


class Stopwatch:
    """Adds up what each section of a tick takes.

    A tick lasts from waking to the next sleep, or to the arm's stop; what no section claims is the rest. For one
    thread. Decorators add to ``spent`` directly, because in every tick each call more is felt.

    Args:
        limits: How late is too late.
        rate_Hz: Ticks per second, for counting skipped slots.
        account: The kernel's account of the thread, read in every tick before the loop sleeps; None leaves causes
            unknown.
        tell: Is told of what exceeds a limit to warn of.
        clock_works: Whether the clock works while the loop sleeps, as one does that drives a simulation. With any other
            clock, processor time that the kernel charges to a sleeper is not its own work: interrupts and a hypervisor
            are charged to whoever was there.
        now_ns: Time, for the sections.

    Attributes:
        spent: The running tick so far, by column, ns. The one of recording includes the ports underneath.
        now_ns: Time, for the sections.
        in_tick: Whether a tick is under way.
        ticks: Ticks that were timed, those of the warm-up included.
        skipped_slots: Slots of the schedule that went by without a tick.
        late_ticks: How many ticks were later than the limit to warn of, by cause.
        slow_cores: In how many ticks the core took longer than the limit.
        newest_late: The newest late ticks, at most 256.
    """

    def __init__(
        self,
        limits: Limits | None = None,
        *,
        rate_Hz: int = CONTROL_RATE_HZ,
        account: ThreadAccount | None = None,
        tell: Callable[[LateTick | SlowCore], None] | None = None,
        clock_works: bool = False,
        now_ns: Callable[[], int] = time.perf_counter_ns,
    ) -> None:
        self.limits = limits if limits is not None else Limits()
        self.rate_Hz, self.now_ns = rate_Hz, now_ns
        self.spent = [0] * COLUMNS
        self.in_tick = False
        self.ticks = self.skipped_slots = self.slow_cores = 0
        self.late_ticks = dict.fromkeys(Cause, 0)
        self.newest_late: deque[LateTick] = deque(maxlen=_KEPT)
        self._account, self._tell, self._clock_works = account, tell, clock_works
        self._warm_up = self.limits.warm_up_ticks
        # Whichever is exceeded first makes the tick worth a closer look.
        watched = [limit for limit in (self.limits.warn_late_ns, self.limits.stop_late_ns) if limit]
        self._look_ns = min(watched) if watched else _NEVER_NS
        self._core_ns = self.limits.warn_core_ns
        self._histograms = Histograms(COLUMNS)
        self._rows = [0] * (COLUMNS * _BATCH)
        self._filled = 0
        self._begun_ns = self._slept_ns = now_ns()
        self._deadline_ns: int | None = None
        self._no_skip_ns = _NS * 3 // (2 * rate_Hz)
        self._before = self._account_now = Account(0, 0, 0) if account is None else account.read()
        self._worked_ns = 0
        self._looked_at: LateTick | None = None

    # What the decorators tell.

    def tick_ends(self, at_ns: int | None = None) -> None:
        """The loop goes to sleep, or is over; now, or since then by the stopwatch's time."""
        self._slept_ns = now = self.now_ns() if at_ns is None else at_ns
        self._worked_ns = now - self._begun_ns if self.in_tick else 0
        if self.in_tick:
            self.in_tick = False
            self.ticks += 1
            if self.ticks > self._warm_up:
                spent = self.spent
                spent[BUSY] = now - self._begun_ns
                if self._core_ns:
                    self._look_at_core(spent)
                start = self._filled
                self._filled = end = start + COLUMNS
                self._rows[start:end] = spent
                if end == COLUMNS * _BATCH:
                    self._fold()
        if self._account is not None:
            self._before, self._account_now = self._account_now, self._account.read()

    def tick_begins(self) -> None:
        """The loop has woken."""
        self.in_tick = True
        self.spent[:] = _NOTHING
        self._begun_ns = self.now_ns()

    def recorder_woke(self) -> None:
        """What a recorder did between the loop's waking and now was recording."""
        self.spent[_RECORD] += self.now_ns() - self._begun_ns

    def schedule_begins(self) -> None:
        """A new trial: its slots have nothing to do with those of the one before."""
        self._deadline_ns = None

    def begun(self, deadline_ns: int, time_ns: int) -> None:
        """The tick for a deadline found this to be the time, run clock.

        Raises:
            DeviceError: Later than the limit to stop at.
        """
        self.spent[LATE] = late = time_ns - deadline_ns
        last, self._deadline_ns = self._deadline_ns, deadline_ns
        if last is not None and deadline_ns - last > self._no_skip_ns:
            # Deadlines are rounded to whole nanoseconds; half a slot more makes the quotient whole again.
            self.skipped_slots += ((deadline_ns - last) * self.rate_Hz + _NS // 2) // _NS - 1
        if late > self._look_ns and self.ticks >= self._warm_up:
            self._look_at(late, time_ns)

    # What comes of it.

    def spread(self, column: int) -> LatenessSpread:
        """Distribution of a section's times over the ticks in which it occurred, or of BUSY or LATE over all."""
        self._fold()
        return self._histograms.spread(column)

    def _look_at(self, late_ns: int, time_ns: int) -> None:
        self._looked_at = tick = LateTick(self.ticks, time_ns, late_ns, self._attribute(late_ns))
        limits = self.limits
        if limits.warn_late_ns and late_ns > limits.warn_late_ns:
            self.late_ticks[tick.attribution.cause] += 1
            self.newest_late.append(tick)
            if self._tell is not None:
                self._tell(tick)
        if limits.stop_late_ns and late_ns > limits.stop_late_ns:
            raise DeviceError("control loop", f"{tick}; {limits.stop_late_ns * 1e-6:g} ms are allowed")

    def _look_at_core(self, spent: list[int]) -> None:
        ports = spent[_RECORD] or spent[_CLOCK] + spent[_FORCE] + spent[_JOINTS] + spent[_SEND]
        core = spent[BUSY] - ports
        if core > self._core_ns:
            self.slow_cores += 1
            if self._tell is not None:
                self._tell(SlowCore(self.ticks - 1, core))

    def _attribute(self, late_ns: int) -> Attribution:
        if self._account is None:
            return attribute(late_ns, [(Cause.UNKNOWN, late_ns)])
        before, slept, woken = self._before, self._account_now, self._account.read()
        # The deadline may have passed before the loop even came to sleep; a clock that works had until then for it.
        to_deadline = self._begun_ns - self._slept_ns - late_ns
        run_asleep = woken.run_ns - slept.run_ns if self._clock_works else 0
        at_work, clock = max(-to_deadline, 0), max(run_asleep - max(to_deadline, 0), 0)
        # Work that began late ends late, through no fault of its own.
        last, carried, carried_cause = self._looked_at, 0, Cause.WOKEN_LATE
        if last is not None and last.tick == self.ticks - 1:
            carried, carried_cause = min(at_work + clock, last.late_ns % (_NS // self.rate_Hz)), last.attribution.cause
        delay_at_work = min(max(at_work - carried, 0), slept.delay_ns - before.delay_ns)
        # What the thread was not charged for. Unless it was given a processor anew, it cannot have waited.
        off = min(max(at_work - carried - delay_at_work, 0), max(self._worked_ns - (slept.run_ns - before.run_ns), 0))
        waited = slept.turns - before.turns > 1
        # After waking, too: for the interpreter, when another thread has it.
        waited_on_waking = woken.turns - slept.turns > 1
        return attribute(
            late_ns,
            [
                (Cause.NO_CPU, delay_at_work + woken.delay_ns - slept.delay_ns),
                (carried_cause, carried),
                (Cause.WAITED if waited else Cause.TAKEN, off),
                (Cause.OWN_WORK, at_work + clock - carried - delay_at_work - off),
                (Cause.WAITED, late_ns if waited_on_waking else 0),
            ],
        )

    def _fold(self) -> None:
        if not self._filled:
            return
        times = np.array(self._rows[: self._filled], np.int64).reshape(-1, COLUMNS)
        self._filled = 0
        inner = times[:, _INNER].sum(axis=1)
        recorded = times[:, _RECORD] > 0
        times[:, _RECORD] -= np.where(recorded, inner, 0)
        times[:, TickSection.REST] = times[:, BUSY] - inner - times[:, _CLAIMED].sum(axis=1)
        there = times > 0
        there[:, BUSY] = there[:, LATE] = True
        self._histograms.add(np.maximum(times, 0), there)
