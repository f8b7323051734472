"""Keeps a run on real devices in time, and tells how well: what the system grants, and how long each section takes."""

from contextlib import AbstractContextManager
from dataclasses import asdict
from types import TracebackType
from typing import Any, Self

from palpate.adapters.config import RealTimeConfig
from palpate.adapters.hardware.real_time.attribution import ThreadAccount
from palpate.adapters.hardware.real_time.lateness import Limits
from palpate.adapters.hardware.real_time.real_time import RealTime
from palpate.adapters.hardware.real_time.sections import COLUMNS, LATE, NAMES
from palpate.adapters.hardware.real_time.stopwatch import Stopwatch
from palpate.adapters.log import dump_json
from palpate.core.control_loop import LoopObserver


class RealTimeSession:
    """Real-time settings and section timing of one run. A context manager; to be entered by the loop's own thread."""

    def __init__(self, config: RealTimeConfig) -> None:
        self._real_time = RealTime(config)
        self._limits = Limits.of(config)
        self.stopwatch: Stopwatch | None = None

    def __enter__(self) -> Self:
        self._real_time.__enter__()
        self.stopwatch = Stopwatch(self._limits, account=ThreadAccount.if_kept())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._real_time.__exit__(kind, error, trace)

    def grants(self) -> list[str]:
        """What the system was asked for, and what it said; one line each."""
        return [str(grant) for grant in self._real_time.grants]

    def timed(self, observers: tuple[LoopObserver, ...]) -> tuple[LoopObserver, ...]:
        """The observers of a trial, with a stopwatch; what they do is charged to recording."""
        watch = self.stopwatch
        if watch is None:
            return observers
        return (watch, *observers, watch.recording) if observers else (watch,)

    def loop(self) -> AbstractContextManager[object]:
        """To be held around a trial: real-time scheduling is for that alone."""
        return self._real_time.loop()

    def report_json(self) -> str:
        """The same for a log."""
        return "" if self.stopwatch is None else dump_json(plain(self.stopwatch))

    def report(self) -> str:
        """Sections and lateness so far, as a table."""
        return "" if self.stopwatch is None else table(self.stopwatch)


def table(stopwatch: Stopwatch) -> str:
    """A table of all sections, in microseconds, and what was late."""
    period_ns = 1e9 / stopwatch.rate_Hz
    lines = [f"{'us':<12}{'ticks':>9}{'median':>9}{'p99':>9}{'p99.9':>9}{'max':>10}{'of period':>11}"]
    ticks = max(stopwatch.spread(LATE).count, 1)
    for column in range(COLUMNS):
        s = stopwatch.spread(column)
        if not s.count:
            continue
        times = f"{s.median_ns * 1e-3:>9.1f}{s.p99_ns * 1e-3:>9.1f}{s.p999_ns * 1e-3:>9.1f}{s.max_ns * 1e-3:>10.1f}"
        # Being late is no use of time.
        share = "" if column == LATE else f"{s.mean_ns * s.count / ticks / period_ns:>11.2%}"
        lines.append(f"{NAMES[column]:<12}{s.count:>9}{times}{share}")
    lines.append(f"skipped slots: {stopwatch.skipped_slots}; {_late_words(stopwatch)}")
    if stopwatch.limits.warn_core_ns:
        limit = f"{stopwatch.limits.warn_core_ns * 1e-6:g} ms"
        lines.append(f"ticks in which the core took longer than {limit}: {stopwatch.slow_cores}")
    return "\n".join(lines)


def plain(stopwatch: Stopwatch) -> dict[str, Any]:
    """The same as values that JSON can hold, times in ns."""
    sections = {NAMES[column]: asdict(stopwatch.spread(column)) for column in range(COLUMNS)}
    return {
        "ticks": stopwatch.ticks,
        "skipped_slots": stopwatch.skipped_slots,
        "slow_cores": stopwatch.slow_cores,
        "late_ticks": {cause.value: count for cause, count in stopwatch.late_ticks.items() if count},
        "blamed": dict(stopwatch.blamed),
        "sections": sections,
    }


def _late_words(stopwatch: Stopwatch) -> str:
    limit_ns = stopwatch.limits.warn_late_ns
    if not limit_ns:
        return "late ticks were not looked for"
    causes = ", ".join(f"{count} {blame}" for blame, count in stopwatch.blamed.most_common())
    total = stopwatch.blamed.total()
    return f"ticks later than {limit_ns * 1e-6:g} ms: {total}{f' ({causes})' if causes else ''}"
