"""The real-time settings of one run, and how punctual its loop was."""

from __future__ import annotations

from contextlib import AbstractContextManager
from time import perf_counter_ns
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np
from typing_extensions import override

from palpate.adapters.config import RealTimeConfig
from palpate.adapters.hardware.real_time.scheduling import RealTime
from palpate.adapters.log import dump_json
from palpate.core.control_loop import LoopObserver
from palpate.core.ports import AppliedCommand, JointCommand, JointSample, Snapshot, WrenchSample
from palpate.core.trial import Supervised, TrialReport

if TYPE_CHECKING:
    from palpate.core.policy import Observation

_NAMES: Final = ("clock", "force", "joints", "perceive", "decide", "control", "supervise", "send", "record")
_CLOCK, _FORCE, _JOINTS, _PERCEIVE, _DECIDE, _CONTROL, _SUPERVISE, _SEND, _RECORD = range(len(_NAMES))
_EDGES_ms: Final = np.array([0.0, *np.geomspace(1e-3, 1e3, 181)])
"""Bins of the histogram of lateness: 30 to a decade."""


class LoopTimer(LoopObserver):
    """Keeps the longest time of each section of a tick, and a histogram of how late ticks begin.

    It is first among the observers: what the others do counts as part of the next section.

    Attributes:
        longest_ns: Longest time of each section, by name.
    """

    def __init__(self) -> None:
        self.longest_ns = dict.fromkeys(_NAMES, 0)
        self.skipped_slots = 0
        self._longest_ns, self._then_ns = [0] * len(_NAMES), 0
        self._late_ns: list[int] = []
        self._worst_ns = 0
        self._counts = np.zeros(len(_EDGES_ms) - 1, np.int64)
        self._report: TrialReport | None = None

    @override
    def begun(self, start_ns: int, report: TrialReport) -> None:
        self._report = report

    @override
    def waited(self, tick: int, deadline_ns: int) -> None:
        self._then_ns = perf_counter_ns()

    @override
    def clock_read(self, deadline_ns: int, time_ns: int) -> None:
        self._late_ns.append(time_ns - deadline_ns)
        self._over(_CLOCK)

    @override
    def force_read(self, sample: WrenchSample) -> None:
        self._over(_FORCE)

    @override
    def joints_read(self, sample: JointSample) -> None:
        self._over(_JOINTS)

    @override
    def sensed(self, observation: Observation | None) -> None:
        self._over(_PERCEIVE)

    @override
    def chosen(self) -> None:
        self._over(_DECIDE)

    @override
    def acted(self, command: JointCommand) -> None:
        self._over(_CONTROL)

    @override
    def supervised(self, supervised: Supervised) -> None:
        self._over(_SUPERVISE)

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        self._over(_SEND)

    @override
    def ended(self) -> None:
        self._over(_RECORD)

    @override
    def stopped(self, error: BaseException | None) -> None:
        self._worst_ns = max(self._worst_ns, *self._late_ns, 0)
        self._counts += np.histogram(np.clip(np.array(self._late_ns) * 1e-6, 0.0, _EDGES_ms[-1]), _EDGES_ms)[0]
        self._late_ns.clear()
        self.longest_ns = dict(zip(_NAMES, self._longest_ns, strict=True))
        if self._report is not None:
            self.skipped_slots += self._report.timing.skipped_slots

    @property
    def ticks(self) -> int:
        """Ticks of the finished trials."""
        return int(self._counts.sum())

    def late_ms(self) -> dict[str, float]:
        """Median, 99th percentile and maximum of how late ticks began, in ms."""
        below = np.cumsum(self._counts)
        median, p99 = (float(_EDGES_ms[np.searchsorted(below, share * self.ticks) + 1]) for share in (0.5, 0.99))
        return {"median": round(median, 4), "p99": round(p99, 4), "max": round(self._worst_ns * 1e-6, 4)}

    def _over(self, section: int) -> None:
        now_ns = perf_counter_ns()
        took_ns, self._then_ns = now_ns - self._then_ns, now_ns
        if took_ns > self._longest_ns[section]:
            self._longest_ns[section] = took_ns


class RealTimeSession:
    """Real-time settings and timing of one run. A context manager; the loop's own thread enters it."""

    def __init__(self, config: RealTimeConfig) -> None:
        self._real_time = RealTime(config)
        self.timer = LoopTimer()

    def __enter__(self) -> Self:
        self._real_time.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._real_time.__exit__()

    def grants(self) -> list[str]:
        """The requests to the system and their results; one line each."""
        return [str(grant) for grant in self._real_time.grants]

    def timed(self, observers: tuple[LoopObserver, ...]) -> tuple[LoopObserver, ...]:
        """The observers of a trial, after the timer."""
        return (self.timer, *observers)

    def loop(self) -> AbstractContextManager[None]:
        """Hold this around a trial: priority and CPU are for that alone."""
        return self._real_time.loop()

    def report_json(self) -> str:
        """The timing of the run so far, for the end of a log."""
        timer = self.timer
        fields: dict[str, Any] = {"ticks": timer.ticks, "skipped_slots": timer.skipped_slots}
        return dump_json({**fields, "late_ms": timer.late_ms(), "longest_ns": timer.longest_ns})

    def report(self) -> str:
        """The timing of the run so far, in two lines."""
        timer = self.timer
        late, longest = timer.late_ms(), timer.longest_ns.items()
        return (
            f"ticks {timer.ticks}, skipped slots {timer.skipped_slots}; late by {late['median']:.2f} ms (median),"
            f" {late['p99']:.2f} ms (99th percentile), {late['max']:.2f} ms (maximum)\n"
            f"longest sections: {', '.join(f'{name} {ns * 1e-6:.2f}' for name, ns in longest)} ms"
        )
