"""Times the sections of every tick, in memory that never grows."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

import numpy as np
from typing_extensions import override

from palpate.adapters.hardware.real_time.attribution import Account, Attribution, Cause, ThreadAccount, attribute
from palpate.adapters.hardware.real_time.lateness import Histograms, LatenessSpread, LateTick, Limits, SlowCore
from palpate.adapters.hardware.real_time.sections import BUSY, COLUMNS, LATE, NAMES, SECTIONS
from palpate.core.control_loop import LoopObserver
from palpate.core.errors import DeviceError
from palpate.core.ports import CONTROL_RATE_HZ, AppliedCommand, JointCommand, JointSample, Snapshot, WrenchSample
from palpate.core.trial import Supervised, TrialReport

if TYPE_CHECKING:
    from palpate.core.policy import Observation


_NS: Final = 1_000_000_000
_BATCH: Final = 256
"""Ticks that are taken over into the distributions at once: one by one that would cost several times as much."""
_KEPT: Final = 256
"""The newest ticks of which is kept that they were late."""
_NEVER_NS: Final = 1 << 62

# What is noted of a tick: when it was woken, when each section was over, when all of it was, and how late it began.
# As plain numbers: members of an enumeration are looked up slowly.
_WOKEN: Final = 0
_CLOCK, _FORCE, _JOINTS, _PERCEIVE, _DECIDE, _CONTROL, _SUPERVISE, _SEND, _RECORD, _END = range(1, SECTIONS + 1)
_LATE: Final = _END + 1
_MARKS: Final = _LATE + 1
_NOTHING: Final = (0,) * _MARKS


class Stopwatch(LoopObserver):
    """Notes when each section of a tick is over, and adds up what the sections take.

    A tick lasts from waking to its end; of one that fails, to the last section that came to its end. What no section
    claims is the rest. For one thread. It stands before a recorder in the loop's observers, and :attr:`recording`
    behind it.

    Args:
        account: The kernel's account of the thread, read in every tick before the loop sleeps; None leaves causes
            unknown.
        clock_works: Whether the clock works while the loop sleeps, as one does that drives a simulation. With any other
            clock, processor time that the kernel charges to a sleeper is not its own work: interrupts and a hypervisor
            are charged to whoever was there.

    Attributes:
        recording: Observes the end of what the observers between the two do when a command was sent.
        ticks: Ticks that were timed, those of the warm-up included.
        late_ticks: How many ticks were later than the limit to warn of, by cause.
        blamed: The same, with our own work apart by the section that took longest.
        slow_cores: In how many ticks the core took longer than the limit.
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
        self.rate_Hz, self._now = rate_Hz, now_ns
        self._marks = [0] * _MARKS
        self.recording: LoopObserver = _RecordingEnd(self._marks, now_ns)
        self._in_tick = False
        self.ticks = self.skipped_slots = self.slow_cores = 0
        self.late_ticks = dict.fromkeys(Cause, 0)
        self.blamed: Counter[str] = Counter()
        self.newest_late: deque[LateTick] = deque(maxlen=_KEPT)
        self._account, self._tell, self._clock_works = account, tell, clock_works
        self._warm_up = self.limits.warm_up_ticks
        # Whichever is exceeded first makes the tick worth a closer look.
        watched = [limit for limit in (self.limits.warn_late_ns, self.limits.stop_late_ns) if limit]
        self._look_ns = min(watched) if watched else _NEVER_NS
        self._core_ns = self.limits.warn_core_ns
        self._histograms = Histograms(COLUMNS)
        self._rows = [0] * (_MARKS * _BATCH)
        self._filled = 0
        self._newest = -1
        self._carried = False
        self._slept_ns = now_ns()
        self._deadline_ns: int | None = None
        self._no_skip_ns = _NS * 3 // (2 * rate_Hz)
        self._before = self._account_now = Account(0, 0, 0) if account is None else account.read()
        self._worked_ns = 0
        self._looked_at: LateTick | None = None

    @override
    def begun(self, start_ns: int, report: TrialReport | None = None) -> None:
        # Its slots have nothing to do with those of the trial before.
        self._newest = -1
        self._deadline_ns = None
        self._rest(self._now(), 0)

    @override
    def waited(self, tick: int, deadline_ns: int) -> None:
        self._in_tick = True
        self._marks[:] = _NOTHING
        self._marks[_WOKEN] = self._now()

    @override
    def clock_read(self, deadline_ns: int, time_ns: int) -> None:
        """A tick begins.

        Raises:
            DeviceError: Later than the limit to stop at.
        """
        self._marks[_CLOCK] = self._now()
        self._marks[_LATE] = late = time_ns - deadline_ns
        last, self._deadline_ns = self._deadline_ns, deadline_ns
        if last is not None and deadline_ns - last > self._no_skip_ns:
            # Deadlines are rounded to whole nanoseconds; half a slot more makes the quotient whole again.
            self.skipped_slots += ((deadline_ns - last) * self.rate_Hz + _NS // 2) // _NS - 1
        if late > self._look_ns and self.ticks >= self._warm_up:
            self._look_at(late, time_ns)

    @override
    def force_read(self, sample: WrenchSample) -> None:
        self._marks[_FORCE] = self._now()

    @override
    def joints_read(self, sample: JointSample) -> None:
        self._marks[_JOINTS] = self._now()

    @override
    def sensed(self, observation: Observation | None) -> None:
        self._marks[_PERCEIVE] = self._now()

    @override
    def chosen(self) -> None:
        self._marks[_DECIDE] = self._now()

    @override
    def acted(self, command: JointCommand) -> None:
        self._marks[_CONTROL] = self._now()

    @override
    def supervised(self, supervised: Supervised) -> None:
        self._marks[_SUPERVISE] = self._now()

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        self._marks[_SEND] = self._now()

    @override
    def ended(self) -> None:
        self._end(self._now())

    @override
    def stopped(self, error: BaseException | None) -> None:
        if self._in_tick:
            self._end(max(self._marks[:_END]))

    def _end(self, now: int) -> None:
        self._in_tick = False
        self.ticks += 1
        marks = self._marks
        marks[_END] = now
        self._newest = start = self._filled
        end = start + _MARKS
        self._rows[start:end] = marks
        if self.ticks > self._warm_up:
            if self._core_ns:
                self._look_at_core(marks)
            self._filled = end
            if end == _MARKS * _BATCH:
                self._fold()
        self._rest(now, now - marks[_WOKEN])

    def _rest(self, now: int, worked_ns: int) -> None:
        """The loop goes to sleep, or is over, after so much work."""
        self._slept_ns, self._worked_ns = now, worked_ns
        if self._account is not None:
            self._before, self._account_now = self._account_now, self._account.read()

    # What comes of it.

    def spread(self, column: int) -> LatenessSpread:
        """Distribution of a section's times over the ticks in which it occurred, or of BUSY or LATE over all."""
        self._fold()
        return self._histograms.spread(column)

    def _look_at(self, late_ns: int, time_ns: int) -> None:
        attribution = self._attribute(late_ns)
        self._looked_at = tick = LateTick(self.ticks, time_ns, late_ns, attribution, self._longest())
        limits = self.limits
        if limits.warn_late_ns and late_ns > limits.warn_late_ns:
            self.late_ticks[tick.attribution.cause] += 1
            self.blamed[tick.blame] += 1
            self.newest_late.append(tick)
            if self._tell is not None:
                self._tell(tick)
        if limits.stop_late_ns and late_ns > limits.stop_late_ns:
            raise DeviceError("control loop", f"{tick}; {limits.stop_late_ns * 1e-6:g} ms are allowed")

    def _longest(self) -> str:
        """What took longest in the tick that made this one late."""
        if self._carried and self._looked_at is not None:
            return self._looked_at.longest
        if self._newest < 0:
            return ""
        marks = self._rows[self._newest : self._newest + _LATE]
        return NAMES[int(np.diff(np.maximum.accumulate(marks)).argmax())]

    def _look_at_core(self, marks: list[int]) -> None:
        # Where a recorder is, what comes after it is the loop's.
        told = max(marks[_SEND], marks[_RECORD])
        asked = max(marks[_CONTROL], marks[_SUPERVISE])
        core = asked - marks[_JOINTS] + marks[_END] - told if marks[_SEND] else 0
        if core > self._core_ns:
            self.slow_cores += 1
            if self._tell is not None:
                self._tell(SlowCore(self.ticks - 1, core))

    def _attribute(self, late_ns: int) -> Attribution:
        self._carried = False
        if self._account is None:
            return attribute(late_ns, [(Cause.UNKNOWN, late_ns)])
        before, slept, woken = self._before, self._account_now, self._account.read()
        # The deadline may have passed before the loop even came to sleep; a clock that works had until then for it.
        to_deadline = self._marks[_WOKEN] - self._slept_ns - late_ns
        run_asleep = woken.run_ns - slept.run_ns if self._clock_works else 0
        at_work, clock = max(-to_deadline, 0), max(run_asleep - max(to_deadline, 0), 0)
        # Work that began late ends late, through no fault of its own.
        last, carried, carried_cause = self._looked_at, 0, Cause.WOKEN_LATE
        if last is not None and last.tick == self.ticks - 1:
            carried, carried_cause = min(at_work + clock, last.late_ns % (_NS // self.rate_Hz)), last.attribution.cause
            self._carried = 2 * carried > at_work + clock
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
        marks = np.array(self._rows[: self._filled], np.int64).reshape(-1, _MARKS)
        self._filled = 0
        times = np.empty((len(marks), COLUMNS), np.int64)
        # What did not occur was over when what came before it was.
        times[:, :SECTIONS] = np.diff(np.maximum.accumulate(marks[:, :_LATE], axis=1), axis=1)
        times[:, BUSY], times[:, LATE] = marks[:, _END] - marks[:, _WOKEN], marks[:, _LATE]
        there = times > 0
        there[:, BUSY] = there[:, LATE] = True
        self._histograms.add(np.maximum(times, 0), there)


class _RecordingEnd(LoopObserver):
    """Behind a recorder: what lies between the command's being sent and this is recording."""

    def __init__(self, marks: list[int], now_ns: Callable[[], int]) -> None:
        self._marks, self._now = marks, now_ns

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        self._marks[_RECORD] = self._now()
