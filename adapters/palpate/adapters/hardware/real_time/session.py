"""Real-time settings for one run, and the timing of its loop."""

from time import perf_counter_ns
from typing import Any, Final

import numpy as np
from typing_extensions import override

from palpate.adapters.config import RealTimeConfig
from palpate.adapters.hardware.real_time.scheduling import RealTime
from palpate.adapters.log import dump_json
from palpate.core.control_loop import LoopObserver
from palpate.core.trial import TrialReport

_EDGES_ms: Final = np.array([0.0, *np.geomspace(1e-3, 1e3, 181)])
"""Bin edges of the lateness histogram, 30 per decade."""


def _ends(section: str) -> Any:
    """Return an observer method that is called at the end of a section of a tick."""
    return lambda timer, *_: timer.end(section)


class LoopTimer(LoopObserver):
    """Observer that records the longest duration of each section of a tick, and a histogram of how late ticks are.

    It must be the first observer, because the time taken by other observers counts towards the next section.

    Attributes:
        longest_ns: Maximum duration of each section, by name.
    """

    def __init__(self) -> None:
        sections = ("clock", "force", "joints", "perceive", "decide", "control", "supervise", "send", "record")
        self.longest_ns = dict.fromkeys(sections, 0)
        self.skipped_slots = 0
        self._then_ns = self._worst_ns = 0
        self._late_ns: list[int] = []
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
        self.end("clock")

    force_read = _ends("force")
    joints_read = _ends("joints")
    sensed = _ends("perceive")
    chosen = _ends("decide")
    acted = _ends("control")
    supervised = _ends("supervise")
    sent = _ends("send")
    ended = _ends("record")

    @override
    def stopped(self, error: BaseException | None) -> None:
        self._worst_ns = max(self._worst_ns, *self._late_ns, 0)
        self._counts += np.histogram(np.clip(np.array(self._late_ns) * 1e-6, 0.0, _EDGES_ms[-1]), _EDGES_ms)[0]
        self._late_ns.clear()
        if self._report is not None:
            self.skipped_slots += self._report.timing.skipped_slots

    @property
    def ticks(self) -> int:
        """Number of ticks in the finished trials."""
        return int(self._counts.sum())

    def late_ms(self) -> dict[str, float]:
        """Return the median, 99th percentile and maximum tick delay in ms."""
        below = np.cumsum(self._counts)
        median, p99 = (float(_EDGES_ms[np.searchsorted(below, share * self.ticks) + 1]) for share in (0.5, 0.99))
        return {"median": round(median, 4), "p99": round(p99, 4), "max": round(self._worst_ns * 1e-6, 4)}

    def end(self, section: str) -> None:
        """Record the duration of the section that is ending."""
        now_ns = perf_counter_ns()
        took_ns, self._then_ns = now_ns - self._then_ns, now_ns
        if took_ns > self.longest_ns[section]:
            self.longest_ns[section] = took_ns


class RealTimeSession(RealTime):
    """Real-time settings and timer for a run. The timer is the first observer of each trial."""

    def __init__(self, config: RealTimeConfig) -> None:
        super().__init__(config)
        self.timer = LoopTimer()

    def report_json(self) -> str:
        """Return the run's timing so far as JSON, for storage at the end of a log."""
        timer = self.timer
        fields: dict[str, Any] = {"ticks": timer.ticks, "skipped_slots": timer.skipped_slots}
        return dump_json({**fields, "late_ms": timer.late_ms(), "longest_ns": timer.longest_ns})

    def report(self) -> str:
        """Return the run's timing so far, as two lines of text."""
        timer = self.timer
        late, longest = timer.late_ms(), timer.longest_ns.items()
        return (
            f"ticks {timer.ticks}, skipped slots {timer.skipped_slots}; late by {late['median']:.2f} ms (median),"
            f" {late['p99']:.2f} ms (99th percentile), {late['max']:.2f} ms (maximum)\n"
            f"longest sections: {', '.join(f'{name} {ns * 1e-6:.2f}' for name, ns in longest)} ms"
        )
