"""Makes one cell: a run in a folder of its own, in whichever process this is called."""

import hashlib
import importlib
import os
import shutil
import sys
import uuid
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Final

from threadpoolctl import threadpool_limits

from palpate.adapters.config import LEARNERS, RunConfig
from palpate.adapters.experiments.build import open_rig, ready_pose, require_usable
from palpate.adapters.experiments.evaluation import ChosenPolicy, run_chosen, write_evaluation
from palpate.adapters.experiments.fitting import configured_perception, fitted_perception, needs_fitting
from palpate.adapters.experiments.foreign import foreign_code, foreign_learns
from palpate.adapters.experiments.policies import learning_policy
from palpate.adapters.experiments.results import RunFolder
from palpate.adapters.experiments.study.cell import CELL_FILE, StudyCell
from palpate.adapters.experiments.study.fields import configured, with_learner
from palpate.adapters.experiments.training import Trainer, run_toml, write_training
from palpate.adapters.log import LOG_FOLDER, TrialRecorder
from palpate.core.errors import ConfigurationError, OutputError, PalpateError, one_line
from palpate.core.ports import Rig, put_folder_in_place, whole_file
from palpate.core.trial import ReadyPose

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
    whole = _train(job, config, folder, code) if learns else _evaluate(job, config, folder)
    if not whole:
        return CellOutcome.INTERRUPTED
    folder.write_json(CELL_FILE, job.cell.document())
    return CellOutcome.FINISHED


@contextmanager
def _begun(
    job: CellJob, config: RunConfig, folder: RunFolder, command: str
) -> Iterator[tuple[ReadyPose, Rig, TrialRecorder | None]]:
    """A run in the cell's folder: the pose that it starts from, its rig, and its recorder."""
    ready = ready_pose(config)
    with ExitStack() as opened:
        rig = opened.enter_context(open_rig(config, ready, ""))
        require_usable(config, ready)
        folder.write("run.toml", run_toml(config, command, trials=job.trials, policy=job.cell.policy))
        recorder = folder.recorder(config.recording, opened)
        yield ready, rig, recorder
    if recorder is not None and recorder.troubles:
        raise OutputError(LOG_FOLDER, recorder.troubles[0], "make room and begin the study again: it goes on")


def _train(job: CellJob, config: RunConfig, folder: RunFolder, code: str) -> bool:
    with _begun(job, config, folder, "train") as (ready, rig, recorder):
        perception = configured_perception(config)
        if perception is None:
            perception = fitted_perception(config, ready, rig)
        policy = learning_policy(config, perception, code)
        trainer = Trainer(config, folder, ready, rig, perception, policy, recorder=recorder)
        trainer.checkpoint()
        trainer.train(job.trials, lambda scored: None)
        trainer.save_policy()
    rows, _ = write_training(config, folder, job.trials)
    return len(rows) == job.trials


def _evaluate(job: CellJob, config: RunConfig, folder: RunFolder) -> bool:
    name = job.cell.policy
    chosen = ChosenPolicy(job.path(name) if name in job.files else name, config)
    with _begun(job, config, folder, "run") as (ready, rig, recorder):
        rows = run_chosen(chosen, config, ready, rig, job.trials, folder=folder, recorder=recorder)
    write_evaluation(config, folder, name, chosen.document, rows, job.trials)
    return len(rows) == job.trials
