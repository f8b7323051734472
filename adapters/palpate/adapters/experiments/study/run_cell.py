"""Makes one cell: a run in a folder of its own, in whichever process this is called."""

import hashlib
import importlib
import os
import shutil
import sys
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Final

from threadpoolctl import threadpool_limits

from palpate.adapters.config import LEARNERS, RunConfig
from palpate.adapters.experiments.fitting import needs_fitting
from palpate.adapters.experiments.foreign import foreign_code, foreign_learns
from palpate.adapters.experiments.results import RunFolder
from palpate.adapters.experiments.run import Run
from palpate.adapters.experiments.study.cell import CELL_FILE, StudyCell
from palpate.adapters.experiments.study.fields import configured, with_learner
from palpate.adapters.log import LOG_FOLDER
from palpate.core.errors import ConfigurationError, OutputError, PalpateError, one_line
from palpate.core.ports import put_folder_in_place, whole_file

UNFINISHED: Final = ".unfinished"
"""Folders that end so are cells that were begun."""


@dataclass(frozen=True)
class CellJob:
    """Everything that a worker needs to make a cell.

    Attributes:
        folder: Absolute path of the study's folder ``cells``.
        job: The study's job file; empty for the paper's job.
        files: Digests of files that results depend on, by their names in the study.
        relative_to: Absolute path of the folder that those names are relative to.
    """

    folder: str
    cell: StudyCell
    base: Mapping[str, Any]
    trials: int
    files: Mapping[str, str]
    relative_to: str
    job: str = ""

    def config(self) -> RunConfig:
        """The cell's configuration; a learner that is named as the policy is what learns."""
        settings = {**self.base, **self.cell.fields, "seed": self.cell.seed}
        return configured(with_learner(settings, self.cell.policy, self.relative_to), self.relative_to, self.job)

    def path(self, name: str) -> str:
        """Absolute path of a file that the study names."""
        return os.path.join(self.relative_to, name)


class CellOutcome(Enum):
    """What came of it."""

    FINISHED = "finished"
    FAILED = "failed"
    INTERRUPTED = "interrupted"
    DIED = "died"


@dataclass(frozen=True)
class CellReport:
    """What came of making a cell."""

    name: str
    outcome: CellOutcome
    problem: str = ""


def make_cell(job: CellJob) -> CellReport:
    """Make a cell in a folder of another name, and rename that when all is in it. What fails leaves nothing behind."""
    cells, name = Path(job.folder), job.cell.name
    # No two attempts share a folder: a worker that was given up may still be at work on its own.
    passing = cells / f"{name}.{uuid.uuid4().hex[:8]}{UNFINISHED}"
    outcome, problem = CellOutcome.FAILED, ""
    try:
        config = job.config()
        with one_thread(config):
            outcome = _run(job, config, passing)
        if outcome is CellOutcome.FINISHED:
            put_in_place(passing, cells / name)
    except PalpateError as error:
        problem = one_line(error)
    except OSError as error:
        problem = f"{error.filename}: {error.strerror}"
    finally:
        shutil.rmtree(passing, ignore_errors=True)
    return CellReport(name, CellOutcome.FAILED if problem else outcome, problem)


def put_in_place(passing: Path, place: Path) -> None:
    """Rename a whole cell. If another worker has been first, its equal one stays."""
    try:
        put_folder_in_place(passing, place)
    except OSError:
        if not (place / CELL_FILE).exists():
            raise


@contextmanager
def one_thread(config: RunConfig) -> Iterator[None]:
    """Keeps numerical libraries to one thread: workers share the processors, and sums depend on how they are split."""
    if needs_fitting(config):
        # Only libraries that are loaded can be told.
        for name in ("sklearn.cluster", "sklearn.decomposition"):
            importlib.import_module(name)
    if torch := sys.modules.get("torch"):
        torch.set_num_threads(1)
    with threadpool_limits(limits=1):
        yield


def digest_of(name: str) -> str:
    """Return the digest of a file that results depend on."""
    return hashlib.sha256(whole_file(name)).hexdigest()


def _run(job: CellJob, config: RunConfig, path: Path) -> CellOutcome:
    for name, digest in job.files.items():
        if digest_of(job.path(name)) != digest:
            raise ConfigurationError("file", name, "a file that stays as it was when the study began")
    path.mkdir()
    folder = RunFolder(path)
    code = "" if job.cell.policy in (*LEARNERS, *job.files) else foreign_code(job.cell.policy)
    learns = job.cell.policy in LEARNERS or (code and foreign_learns(code, config))
    run, name = Run(config), job.cell.policy
    if learns:
        result = run.train(job.trials, path, name)
    else:
        result = run.evaluate(job.trials, job.path(name) if name in job.files else name, path)
    if result.troubles:
        raise OutputError(LOG_FOLDER, result.troubles[0], "make room and begin the study again: it goes on")
    if not result.finished:
        return CellOutcome.INTERRUPTED
    folder.write_json(CELL_FILE, job.cell.document())
    return CellOutcome.FINISHED
