"""Engines, with cells that only take note of having been made."""

import os
import signal
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import pytest

from palpate.adapters.experiments.study import CellJob, CellOutcome, CellReport, Engine, Processes, StudyCell, engines
from tests.unit.adapters.experiments.study.studies import job_in

Events = list[tuple[int, CellOutcome]]


def make(job: CellJob) -> CellReport:
    """Seed 2 kills its worker at each attempt."""
    if job.cell.seed == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return CellReport(job.cell.name, CellOutcome.FINISHED)


def jobs_in(folder: Path, seeds: Sequence[int]) -> list[CellJob]:
    return [job_in(folder, StudyCell({}, "torque", seed)) for seed in seeds]


def events_of(engine: Engine, jobs: Sequence[CellJob]) -> Events:
    seeds = {job.cell.name: job.cell.seed for job in jobs}
    return [(seeds[report.name], report.outcome) for report in engine.run(jobs)]


def test_a_cell_over_which_workers_always_die_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines, "MOST_DEATHS", 2)
    events = events_of(Processes(1, make), jobs_in(tmp_path, [2, 0]))
    assert Counter(events) == {
        (2, CellOutcome.DIED): 2,
        (2, CellOutcome.FAILED): 1,
        (0, CellOutcome.FINISHED): 1,
    }
