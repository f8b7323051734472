"""One run of a study: its settings, policy and seed, and how it is made in a folder of its own."""

import importlib
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from threadpoolctl import threadpool_limits

from palpate.adapters.config import LEARNERS, RunConfig
from palpate.adapters.experiments.fitting import configured_perception, needs_fitting
from palpate.adapters.experiments.foreign import foreign_code, foreign_learns
from palpate.adapters.experiments.run import Run
from palpate.adapters.experiments.training import Subject, run_toml
from palpate.adapters.files import new_folder
from palpate.adapters.log import LOG_FOLDER
from palpate.core.errors import OutputError

SUMMARY: Final = "summary.json"
"""A folder that holds it is finished."""


@dataclass(frozen=True)
class Condition:
    """What distinguishes one run of a study from the others.

    Attributes:
        name: Of its folder.
        fields: Settings that the study varies, by dotted name.
        policy: A learner, a baseline, a policy file or code of one's own.
        file: Absolute path of the policy file; empty for none.
    """

    name: str
    fields: Mapping[str, Any]
    policy: str
    config: RunConfig
    trials: int
    file: str = ""

    @property
    def what(self) -> str:
        """The policy as a worker with another working folder finds it."""
        return self.file or self.policy

    @property
    def learns(self) -> bool:
        """Whether the policy is trained."""
        code = "" if self.file else foreign_code(self.policy)
        return self.policy in LEARNERS or bool(code and foreign_learns(code, self.config))

    def record(self) -> str:
        """Return the text of ``run.toml``."""
        return run_toml(self.config, "train" if self.learns else "run", trials=self.trials, policy=self.what)

    def require_possible(self) -> None:
        """Refuse now what would be refused in the night.

        Raises:
            ConfigurationError: A setting is refused, the arm does not reach, or the policy does not fit.
        """
        run = Run(self.config)
        run.chosen("random" if self.learns else self.what)
        if self.learns and (perception := configured_perception(self.config)) is not None:
            Subject.of(self.config, self.policy).policy(self.config, perception)


def make(condition: Condition, study: Path) -> None:
    """Run a condition in a folder of its own in ``study``, which is there only when all is in it.

    Raises:
        PalpateError: A trial failed.
        OutputError: The folder cannot be made, or a trial not be recorded.
    """
    if not study.is_dir():
        raise OutputError(str(study), "is not there", "all workers need the folder of the study under one name")
    place = study / condition.name
    try:
        with _one_thread(condition.config), new_folder(place) as path:
            run = Run(condition.config)
            if condition.learns:
                result = run.train(condition.trials, path, condition.policy)
            else:
                result = run.evaluate(condition.trials, condition.what, path)
            if result.troubles:
                remedy = "make room and run the same command again: it continues"
                raise OutputError(LOG_FOLDER, result.troubles[0], remedy)
            if not result.finished:
                raise KeyboardInterrupt
    except OutputError:
        # A worker that was taken for dead was first.
        if not (place / SUMMARY).exists():
            raise


@contextmanager
def _one_thread(config: RunConfig) -> Iterator[None]:
    """Keep numerical libraries to one thread: workers share processors, and sums depend on how they are split."""
    if needs_fitting(config):
        # The limit reaches loaded libraries only.
        for name in ("sklearn.cluster", "sklearn.decomposition"):
            importlib.import_module(name)
    if torch := sys.modules.get("torch"):
        torch.set_num_threads(1)
    with threadpool_limits(limits=1):
        yield


def policy_file(name: str) -> str:
    """Return the absolute path of the policy file of that name; empty where there is none."""
    return os.path.abspath(name) if os.path.isfile(name) else ""
