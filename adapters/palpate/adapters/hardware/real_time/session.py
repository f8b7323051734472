"""Keeps a run on real devices in time, and tells how well: what the system grants, and how long each section takes."""

from contextlib import AbstractContextManager
from types import TracebackType
from typing import Self

from palpate.adapters.config import RealTimeConfig
from palpate.adapters.hardware.real_time.attribution import ThreadAccount
from palpate.adapters.hardware.real_time.lateness import Limits
from palpate.adapters.hardware.real_time.real_time import RealTime
from palpate.adapters.hardware.real_time.report import plain, table
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
