"""Engines, with cells that only take note of having been made."""

import os
import signal
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from palpate.adapters.experiments.study.cell import StudyCell
from palpate.adapters.experiments.study.engines import MOST_DEATHS, Engine, Processes
from palpate.adapters.experiments.study.run_cell import CellJob, CellOutcome, CellReport
from tests.unit.adapters.experiments.study.studies import job_in

Events = list[tuple[int, CellOutcome]]


def make(job: CellJob) -> CellReport:
    """Seed 1 kills its worker at the first attempt, seed 2 at each."""
    seed = job.cell.seed
    notes = Path(job.folder) / str(seed)
    with notes.open("a") as stream:
        stream.write(f"{os.getpid()}\n")
    time.sleep(0.05)
    if seed == 2 or (seed == 1 and len(notes.read_text().splitlines()) == 1):
        os.kill(os.getpid(), signal.SIGKILL)
    # Longer than it takes for the other worker to die and be replaced.
    time.sleep(0.4)
    return CellReport(job.cell.name, CellOutcome.FINISHED)


def jobs_in(folder: Path, seeds: Sequence[int]) -> list[CellJob]:
    return [job_in(folder, StudyCell({}, "torque", seed)) for seed in seeds]


def events_of(engine: Engine, jobs: Sequence[CellJob]) -> Events:
    seeds = {job.cell.name: job.cell.seed for job in jobs}
    return [(seeds[report.name], report.outcome) for report in engine.run(jobs)]


def attempts(folder: Path) -> Counter[int]:
    return Counter({int(path.name): len(path.read_text().splitlines()) for path in folder.iterdir()})


def test_a_worker_that_dies_loses_its_cell_alone(tmp_path: Path) -> None:
    events = events_of(Processes(2, make), jobs_in(tmp_path, [0, 1, 3, 4]))
    finished = [seed for seed, outcome in events if outcome is CellOutcome.FINISHED]
    assert sorted(finished) == [0, 1, 3, 4]
    assert [event for event in events if event[1] is not CellOutcome.FINISHED] == [(1, CellOutcome.DIED)]
    assert attempts(tmp_path) == {0: 1, 1: 2, 3: 1, 4: 1}


def test_a_cell_over_which_workers_always_die_is_given_up(tmp_path: Path) -> None:
    events = events_of(Processes(1, make), jobs_in(tmp_path, [2, 0]))
    assert Counter(events) == {
        (2, CellOutcome.DIED): MOST_DEATHS,
        (2, CellOutcome.FAILED): 1,
        (0, CellOutcome.FINISHED): 1,
    }


def test_closing_ends_the_workers(tmp_path: Path) -> None:
    reports = Processes(2, make).run(jobs_in(tmp_path, range(10, 30)))
    next(reports)
    reports.close()
    workers = {int(line) for path in tmp_path.iterdir() for line in path.read_text().splitlines()}
    assert workers
    assert not any(os.path.exists(f"/proc/{worker}") for worker in workers)
