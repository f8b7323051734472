"""Where cells are made: in this process, or in several. What comes of them does not depend on it."""

from __future__ import annotations

import os
import signal
import threading
import time
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import chain
from typing import Final

from joblib.externals.loky import ProcessPoolExecutor

from palpate.adapters.experiments.study.run_cell import CellJob, CellOutcome, CellReport, make_cell

MOST_DEATHS: Final = 3
"""A cell over which so many workers died is given up."""
_WATCH_S: Final = 0.1
ONE_THREAD: Final = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMEXPR")}

Make = Callable[[CellJob], CellReport]


class Engine(ABC):
    """Makes cells."""

    @abstractmethod
    def run(self, jobs: Iterable[CellJob]) -> Generator[CellReport, None, None]:
        """Make cells; a report as soon as one is done, in any order, and one whenever a worker died.

        Closing the iterator ends the workers.
        """


class Sequential(Engine):
    """One cell after the other in this process."""

    def run(self, jobs: Iterable[CellJob]) -> Generator[CellReport, None, None]:
        """See :class:`Engine`."""
        for job in jobs:
            report = make_cell(job)
            if report.outcome is CellOutcome.INTERRUPTED:
                raise KeyboardInterrupt
            yield report


class Processes(Engine):
    """Several processes of joblib's loky.

    Each is a pool of its own: loky gives up a whole pool when one of its processes dies, and with it every cell that
    the others were at.

    Args:
        count: Number of processes.
        make: Makes a cell there.
    """

    def __init__(self, count: int, make: Make = make_cell) -> None:
        self._count, self._make = count, make

    def run(self, jobs: Iterable[CellJob]) -> Generator[CellReport, None, None]:
        """See :class:`Engine`."""
        again: deque[CellJob] = deque()
        fresh, deaths = iter(jobs), Counter[str]()
        idle = [_Worker() for _ in range(self._count)]
        running: dict[Future[CellReport], tuple[_Worker, CellJob]] = {}
        workers = list(idle)
        try:
            while True:
                while idle and (job := next(chain(_taken(again), fresh), None)) is not None:
                    worker = idle.pop()
                    running[worker.start(self._make, job)] = worker, job
                if not running:
                    return
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    worker, job = running.pop(future)
                    idle.append(worker)
                    report = _report(future, job)
                    yield report
                    if report.outcome is CellOutcome.DIED:
                        worker.end()
                        deaths[report.name] += 1
                        if deaths[report.name] < MOST_DEATHS:
                            again.append(job)
                        else:
                            problem = f"its worker died {MOST_DEATHS} times"
                            yield CellReport(report.name, CellOutcome.FAILED, problem)
        finally:
            for worker in workers:
                worker.end()


def _taken(jobs: deque[CellJob]) -> Iterator[CellJob]:
    while jobs:
        yield jobs.popleft()


def _report(future: Future[CellReport], job: CellJob) -> CellReport:
    try:
        report = future.result()
    except BrokenProcessPool:
        return CellReport(job.cell.name, CellOutcome.DIED)
    # Somebody interrupted the worker itself: the same as if it had died.
    return CellReport(report.name, CellOutcome.DIED) if report.outcome is CellOutcome.INTERRUPTED else report


class _Worker:
    """A pool of one process, made anew after it died."""

    def __init__(self) -> None:
        self._pool: ProcessPoolExecutor | None = None

    def start(self, make: Make, job: CellJob) -> Future[CellReport]:
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                max_workers=1, timeout=None, initializer=_begin, initargs=(os.getpid(),), env=ONE_THREAD
            )
        future: Future[CellReport] = self._pool.submit(make, job)
        return future

    def end(self) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=True, kill_workers=True)
            self._pool = None


def _begin(study: int) -> None:
    """In a worker: Ctrl-C is the study's affair, which then ends its workers; and they do not outlive it."""
    os.setpgrp()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(study,), daemon=True).start()


def _end_with(parent: int) -> None:
    # A worker of loky whose parent was killed waits for work for ever.
    while os.getppid() == parent:
        time.sleep(_WATCH_S)
    os.kill(os.getpid(), signal.SIGKILL)
