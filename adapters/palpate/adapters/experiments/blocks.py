"""Trials of a policy in several processes of the simulator."""

from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Final

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments.build import ready_pose
from palpate.adapters.experiments.evaluation import FIRST_EVALUATION_TRIAL, ChosenPolicy
from palpate.adapters.experiments.executor import in_processes, interrupts_wait
from palpate.adapters.experiments.results import RunFolder, TrialRow
from palpate.adapters.experiments.trial import ScoredTrial
from palpate.adapters.experiments.trials import Recording, Trials
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import PalpateError

BLOCK: Final = 10
"""Trials that a process runs at a time. Each block begins with a new policy object."""


def run_blocks(
    config: RunConfig,
    policy: str,
    trials: int,
    jobs: int,
    folder: RunFolder | None,
    on_trial: Callable[[int], object],
) -> tuple[list[TrialRow], list[str]]:
    """Run trials in several processes, until all are finished or Ctrl-C ends them.

    A policy that keeps nothing from trial to trial gives the same trials and files as in one process.

    Returns:
        The finished trials, and what could not be recorded.

    Raises:
        PalpateError: A trial failed, in the words of its own error.
    """
    rows, troubles = list[TrialRow](), list[str]()
    # Workers that are there already keep the working folder in which they were begun.
    path = None if folder is None else folder.path.absolute()
    calls = ((config, policy, path, first, min(BLOCK, trials - first)) for first in range(0, trials, BLOCK))
    with closing(in_processes(_run_block, calls, jobs)) as blocks:
        try:
            for done, lost, problem in blocks:
                with interrupts_wait():
                    keep = TrialRow.of if folder is None else folder.append_trial
                    rows += [keep(scored, FIRST_EVALUATION_TRIAL) for scored in done]
                    troubles += lost
                if problem:
                    raise PalpateError(problem)
                on_trial(len(done))
        except KeyboardInterrupt:
            pass
    return rows, troubles


def _run_block(
    config: RunConfig, policy: str, folder: Path | None, first: int, trials: int
) -> tuple[list[ScoredTrial], list[str], str]:
    """Return the trials, what could not be recorded, and the error that ended them: not all errors can be sent."""
    problem, done = "", list[ScoredTrial]()
    chosen, ready, begin = ChosenPolicy(policy, config), ready_pose(config), FIRST_EVALUATION_TRIAL + first
    with ExitStack() as opened:
        rig = opened.enter_context(SimulatedRig(config, ready))
        recording = Recording(None if folder is None else RunFolder(folder).recorder(config.recording, opened))
        work = Trials(
            config, ready, rig, chosen.perception, chosen.on(rig), recording,
            name=chosen.baseline, first=FIRST_EVALUATION_TRIAL,
        )  # fmt: skip
        try:
            work.run_all(range(begin, begin + trials), done.append)
        except PalpateError as error:
            problem = str(error)
    return done, list(recording.troubles), problem
