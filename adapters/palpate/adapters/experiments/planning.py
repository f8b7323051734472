"""Simulated trials in several processes, to evaluate a policy or, in randomly drawn cells, a job."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any, Final

from palpate.adapters.config import RunConfig, overlay, task_kind
from palpate.adapters.experiments.build import build_perception, plain_perception, ready_pose
from palpate.adapters.experiments.evaluation import FIRST_EVALUATION_TRIAL, ChosenPolicy, true_hole_m
from palpate.adapters.experiments.executor import in_processes, interrupts_wait
from palpate.adapters.experiments.policies import baseline, learning_policy
from palpate.adapters.experiments.results import RunFolder, TrialRow
from palpate.adapters.experiments.trial import ScoredTrial, fit_of
from palpate.adapters.experiments.trials import Recording, Trials
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import PalpateError
from palpate.core.policy import learner_of
from palpate.core.ports import Rig
from palpate.core.trial import Purpose, generator

BLOCK: Final = 10
"""Number of trials in a block. Each block starts with a new policy object."""


def run_blocks(
    config: RunConfig,
    policy: str,
    trials: int,
    jobs: int,
    folder: RunFolder | None,
    on_trial: Callable[[int], object],
) -> tuple[list[TrialRow], list[str]]:
    """Run trials in several processes until all are finished or Ctrl-C ends them; return rows and recording failures.

    A policy without memory of past trials produces the same trials and files as in one process.

    Raises:
        PalpateError: A trial failed. The message is the trial's error message.
    """
    rows, losses = list[TrialRow](), list[str]()
    # Workers that are already running keep the working folder in which they started.
    path = None if folder is None else folder.path.absolute()
    calls = ((config, policy, path, first, min(BLOCK, trials - first)) for first in range(0, trials, BLOCK))
    with closing(in_processes(_run_block, calls, jobs)) as blocks:
        try:
            for done, lost, problem in blocks:
                with interrupts_wait():
                    keep = TrialRow.of if folder is None else folder.append_trial
                    rows += [keep(scored, FIRST_EVALUATION_TRIAL) for scored in done]
                    losses += lost
                if problem:
                    raise PalpateError(problem)
                on_trial(len(done))
        except KeyboardInterrupt:
            pass
    return rows, losses


def _run_block(
    config: RunConfig, policy: str, folder: Path | None, first: int, trials: int
) -> tuple[list[ScoredTrial], list[str], str]:
    """Return the trials, recording failures, and the text of any error, because not every error can be pickled."""
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
    return done, list(recording.losses), problem


SERIES: Final = 10
"""Number of trials per new learner; the first one trains it and does not count."""
_LEAST_FRICTION: Final = 0.1
"""Minimum friction for dry metal on metal or plastic."""
_NOISE_SHARES: Final = (0.8, 1.25)
_STIFFNESS_SHARES: Final = (0.9, 1.1)
"""Range of factors on a gripper's stiffness, which is known to within about ten per cent."""
_SPRINGS: Final = ("lateral_N_per_mm", "axial_N_per_mm", "tilt_Nm_per_rad", "torsion_Nm_per_rad")


def drawn_world(config: RunConfig, trial: int, stated: Mapping[str, Any]) -> RunConfig:
    """Draw the cell for a trial: plate, tilt, friction, noise and stiffness, each uniformly within its range.

    The cell itself draws the hole and the headings.

    Args:
        stated: The job's ``cell`` table; its friction, if any, is not redrawn.
    """
    rng = generator(config.seed, Purpose.HIDDEN, trial)
    height, tilt, friction, noise, stiffness = rng.uniform(size=5).tolist()
    cell, place = config.cell, config.place
    most = config.part.friction_max
    peg: dict[str, Any] = {}
    if "friction" not in stated.get("peg", {}):
        least = min(_LEAST_FRICTION, most)
        peg["friction"] = least + friction * (most - least)
    share = _within(noise, _NOISE_SHARES)
    return overlay(config, {
        "cell": {
            "peg": peg,
            "hole_height_error_mm": _within(height, (-place.height_uncertainty_mm, place.height_uncertainty_mm)),
            "tilt_mrad": tilt * cell.tilt_mrad,
            "sensor": {
                "force_noise_N": share * cell.sensor.force_noise_N,
                "torque_noise_Nm": share * cell.sensor.torque_noise_Nm,
            },
            "compliance": {
                name: _within(stiffness, _STIFFNESS_SHARES) * getattr(cell.compliance, name) for name in _SPRINGS
            },
        }
    })  # fmt: skip


def run_series(
    config: RunConfig, policy: str, numbers: range, world: Callable[[int], RunConfig] | None = None
) -> Iterator[ScoredTrial]:
    """Run trials with a rule or a new learner, each in its own ``world`` if given; a trip ends only its own trial."""
    ready, rigs = ready_pose(config), list[Rig]()
    perception = plain_perception(config) if policy else build_perception(config)
    rule = baseline(policy, config, lambda: true_hole_m(rigs[-1])) if policy else learning_policy(config, perception)
    learner = learner_of(rule)
    for trial in numbers:
        with SimulatedRig(config if world is None else world(trial), ready) as rig:
            rigs.append(rig)
            before = None if learner is None else learner.get_state()
            scored = Trials(config, ready, rig, perception, rule).run(trial)
            if scored.trip and learner is not None and before is not None:
                learner.set_state(before)
        yield scored


def untrue(config: RunConfig, scored: ScoredTrial) -> bool:
    """Return True if a trial was falsely reported as inserted."""
    truth = scored.truth
    return truth is not None and task_kind(config.task.name).untrue(config.task, scored.report, truth, fit_of(config))


def simulate(
    config: RunConfig, policy: str, trials: int, jobs: int, stated: Mapping[str, Any]
) -> Iterator[tuple[list[ScoredTrial], int]]:
    """Run a job's trials in series, each with a new policy; yield the counted trials and the number of trials run."""
    blocks = [(config, policy, first, min(SERIES, trials - first), stated) for first in range(0, trials, SERIES)]
    yield from in_processes(_series, blocks, jobs)


def _series(
    config: RunConfig, policy: str, first: int, trials: int, stated: Mapping[str, Any]
) -> tuple[list[ScoredTrial], int]:
    numbers = range(first, first + trials)
    done = list(run_series(config, policy, numbers, lambda trial: drawn_world(config, trial, stated)))
    return done if policy else done[1:], len(done)


def _within(share: float, ends: tuple[float, float]) -> float:
    return ends[0] + share * (ends[1] - ends[0])
