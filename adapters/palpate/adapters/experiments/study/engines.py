"""Where cells are made: in this process, or in several. What comes of them does not depend on it."""

import os
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from itertools import chain, islice
from multiprocessing import get_context
from typing import Final

from pebble import ProcessExpired, ProcessPool
from typing_extensions import override

from palpate.adapters.experiments.study.run_cell import CellJob, CellOutcome, CellReport, make_cell
from palpate.adapters.experiments.workers import begin_worker, interrupts_wait

MOST_DEATHS: Final = 3
"""A cell over which so many workers died is given up."""

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

    @override
    def run(self, jobs: Iterable[CellJob]) -> Generator[CellReport, None, None]:
        for job in jobs:
            report = make_cell(job)
            if report.outcome is CellOutcome.INTERRUPTED:
                raise KeyboardInterrupt
            yield report


class Processes(Engine):
    """Several processes of a pebble pool, which starts another for one that dies: a death costs the cell it was at."""

    def __init__(self, count: int, make: Make = make_cell) -> None:
        self._count, self._make = count, make

    @override
    def run(self, jobs: Iterable[CellJob]) -> Generator[CellReport, None, None]:
        again: deque[CellJob] = deque()
        fresh, deaths = iter(jobs), Counter[str]()
        running: dict[Future[CellReport], CellJob] = {}
        # Spawned: a fork would take over the threads' locks of libraries that are loaded here.
        pool = ProcessPool(self._count, initializer=begin_worker, initargs=[os.getpid()], context=get_context("spawn"))
        try:
            while True:
                for job in islice(chain(_taken(again), fresh), self._count - len(running)):
                    with interrupts_wait():
                        running[pool.schedule(self._make, args=[job])] = job
                if not running:
                    return
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    job = running.pop(future)
                    report = _report(future, job)
                    yield report
                    if report.outcome is CellOutcome.DIED:
                        deaths[report.name] += 1
                        if deaths[report.name] < MOST_DEATHS:
                            again.append(job)
                        else:
                            problem = f"its worker died {MOST_DEATHS} times"
                            yield CellReport(report.name, CellOutcome.FAILED, problem)
        finally:
            pool.stop()
            pool.join()


def _taken(jobs: deque[CellJob]) -> Iterator[CellJob]:
    while jobs:
        yield jobs.popleft()


def _report(future: Future[CellReport], job: CellJob) -> CellReport:
    try:
        report = future.result()
    except ProcessExpired:
        return CellReport(job.cell.name, CellOutcome.DIED)
    # Somebody interrupted the worker itself: the same as if it had died.
    return CellReport(report.name, CellOutcome.DIED) if report.outcome is CellOutcome.INTERRUPTED else report
