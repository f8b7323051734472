"""A policy by name or file, checked before anything is built, and then put to work on a rig."""

import os
from collections.abc import Callable, Generator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from palpate.adapters.config import RunConfig, task_kind
from palpate.adapters.experiments.build import build_task, plain_perception, ready_pose, supervisor_of
from palpate.adapters.experiments.claim import Claim
from palpate.adapters.experiments.figure import trials_picture
from palpate.adapters.experiments.fitting import configured_perception
from palpate.adapters.experiments.foreign import foreign_code
from palpate.adapters.experiments.policies import (
    COMPARATORS,
    NO_POLICY,
    Hole,
    accepted_policies,
    comparator,
    foreign_document,
    loaded_policy,
    perception_of,
    policy_for,
    pose_of,
)
from palpate.adapters.experiments.results import RunFolder, TrialRow
from palpate.adapters.experiments.statistics import policy_summary
from palpate.adapters.experiments.trial import (
    ScoredTrial,
    interrupting,
    require_sound,
    run_scored_trial,
    trial_setup,
)
from palpate.adapters.experiments.workers import in_processes, interrupts_wait
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.adapters.log import TrialRecorder, core_sha256, made_with, processor
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.control_loop import run_trial
from palpate.core.errors import ConfigurationError, PalpateError
from palpate.core.perception import Perception
from palpate.core.policy import ForeignPolicy, Policy, PolicyDocument, learner_of
from palpate.core.ports import Rig
from palpate.core.trial import TRIALS_OF_A_SERIES, Outcome, ReadyPose, TrialReport

FIRST_EVALUATION_TRIAL: Final = TRIALS_OF_A_SERIES
"""Trials that evaluate are numbered from here for their random streams: never the ones that a policy was trained on."""


BLOCK: Final = 10
"""Trials that a process of several runs at a time. Each block begins with a new policy object."""


@dataclass(frozen=True)
class Recorded:
    """How the trials of a policy are recorded.

    Attributes:
        comparator: Name of the policy, if no policy file can hold it.
        subfolder: Where in the recorder's folder the logs go.
    """

    recorder: TrialRecorder
    command: str
    comparator: str = ""
    subfolder: str = ""


def run_policy(
    config: RunConfig,
    ready: ReadyPose,
    rig: Rig,
    perception: Perception,
    policy: Policy,
    trials: int,
    on_trial: Callable[[ScoredTrial], None],
    recorded: Recorded | None = None,
    session: RealTimeSession | None = None,
    first: int = 0,
) -> list[TrialRow]:
    """Run a policy, recorded as frozen or learning; returns early on Ctrl-C with the trials that were finished.

    Args:
        first: Number of the first trial.

    Raises:
        FaultLatchedError: A trip or fault on this rig has not been acknowledged (``rig.latch.acknowledge``).
        DeviceError: A sensor failed, the arm was stopped, or the supervisor tripped.
    """
    recorder = None if recorded is None else recorded.recorder
    task = build_task(config, ready, perception, policy)
    supervisor = supervisor_of(rig, config, ready)
    if recorded is not None:
        learner = learner_of(policy)
        recorded.recorder.of(
            recorded.command, config, ready, task, perception, policy,
            name=recorded.comparator, frozen=learner is None or learner.frozen, subfolder=recorded.subfolder,
        )  # fmt: skip
    rows: list[TrialRow] = []
    ended = False

    def end() -> None:
        nonlocal ended
        ended = True
        task.interrupt()

    with interrupting(end):
        for trial in range(first, first + trials):
            scored = run_scored_trial(
                config, rig, task, FIRST_EVALUATION_TRIAL + trial, recorder, FIRST_EVALUATION_TRIAL, supervisor, session
            )
            if scored.report.outcome is Outcome.INTERRUPTED:
                break
            rows.append(TrialRow.of(scored, FIRST_EVALUATION_TRIAL))
            on_trial(scored)
            require_sound(rig, scored, FIRST_EVALUATION_TRIAL)
            if ended:
                break
    return rows


NOBODY_KNOWS: Final = "a policy that need not know where the hole is, on a real rig"


class ChosenPolicy:
    """A policy by name or file, checked before anything is built.

    Args:
        name: A comparator's name, the path of a policy file, or what :func:`foreign_code` finds.

    Attributes:
        document: The policy file; None for a comparator.
    """

    def __init__(self, name: str, config: RunConfig) -> None:
        self.name, self._config = policy_for(config, name), config
        self.document: PolicyDocument | None = None
        self.perception: Perception
        if self.name in (*COMPARATORS, NO_POLICY):
            self.label = _who(config, self.name)
            self.perception = plain_perception(config)
            self._made(tuple)
        else:
            self.label = Path(name).parent.name or Path(name).stem
            configured, code = configured_perception(config), foreign_code(name)
            if os.path.exists(name) or not code:
                if not os.path.exists(name):
                    raise ConfigurationError("policy", name, accepted_policies())
                self.document = PolicyDocument.load(Path(name))
                self.perception = perception_of(self.document, config, configured)
                self._made(tuple)
            elif configured is None:
                accepted = "a policy file of a training, for it holds the perception that this configuration lacks"
                raise ConfigurationError("policy", name, accepted)
            else:
                self.label, self.perception = code.partition(":")[2], configured
                self.document = foreign_document(code, config, configured)

    @property
    def comparator(self) -> str:
        """Its name, if no policy file can hold it; else empty."""
        return self.name if self.document is None else ""

    def on(self, rig: Rig) -> Policy:
        """The policy at work on a rig; it does not learn."""
        return at_work(self._made(lambda: true_hole_m(rig)), rig)

    def _made(self, hole_m: Hole) -> Policy:
        """The policy; made once without a rig, so that what it refuses is refused before anything is built."""
        if self.document is None:
            return comparator(self.name, self._config, hole_m)
        return loaded_policy(self.document, self._config, self.perception, frozen=True)


def run_chosen(
    chosen: ChosenPolicy,
    config: RunConfig,
    ready: ReadyPose,
    rig: Rig,
    trials: int,
    *,
    folder: RunFolder | None = None,
    recorder: TrialRecorder | None = None,
    command: str = "run",
    subfolder: str = "",
    session: RealTimeSession | None = None,
    on_trial: Callable[[], object] = lambda: None,
) -> list[TrialRow]:
    """Run a chosen policy, one object for all trials, as :func:`run_policy` does, and note each in the run's folder.

    Args:
        subfolder: Where in the recorder's folder the logs go.
    """
    recorded = None if recorder is None else Recorded(recorder, command, chosen.comparator, subfolder)

    def done(scored: ScoredTrial) -> None:
        if folder is not None:
            folder.append_trial(scored, FIRST_EVALUATION_TRIAL)
        on_trial()

    return run_policy(config, ready, rig, chosen.perception, chosen.on(rig), trials, done, recorded, session)


def run_in_processes(
    name: str, config: RunConfig, trials: int, folder: RunFolder, jobs: int
) -> Generator[tuple[list[TrialRow], list[str]], None, None]:
    """Run a policy in the simulator in blocks, each with a policy object of its own.

    A policy that keeps nothing from trial to trial gives the same trials and files as with :func:`run_chosen`.

    Yields:
        The trials of a block in their order, and what could not be recorded of them.

    Raises:
        PalpateError: A trial failed, in the words of its own error.
    """
    # Workers that are there already keep the working folder in which they were begun.
    path = folder.path.absolute()
    blocks = ((name, config, path, first, min(BLOCK, trials - first)) for first in range(0, trials, BLOCK))
    for done, troubles, problem in in_processes(_run_block, blocks, jobs):
        with interrupts_wait():
            for scored in done:
                folder.append_trial(scored, FIRST_EVALUATION_TRIAL)
        if problem:
            raise PalpateError(problem)
        yield [TrialRow.of(scored, FIRST_EVALUATION_TRIAL) for scored in done], troubles


def _run_block(
    name: str, config: RunConfig, folder: Path, first: int, trials: int
) -> tuple[list[ScoredTrial], list[str], str]:
    """Return the trials, what could not be recorded, and the error that ended them: not all errors can be sent."""
    problem = ""
    chosen, ready, done = ChosenPolicy(name, config), ready_pose(config), list[ScoredTrial]()
    with ExitStack() as opened:
        rig = opened.enter_context(SimulatedRig(config, ready))
        recorder = RunFolder(folder).recorder(config.recording, opened)
        recorded = None if recorder is None else Recorded(recorder, "run", chosen.comparator)
        policy = chosen.on(rig)
        try:
            run_policy(config, ready, rig, chosen.perception, policy, trials, done.append, recorded, first=first)
        except PalpateError as error:
            problem = str(error)
    return done, [] if recorder is None else list(recorder.troubles), problem


def at_work(policy: Policy, rig: Rig) -> Policy:
    """The policy; how long a foreign one takes is measured by the rig's clock from now on."""
    if isinstance(policy, ForeignPolicy):
        policy.now_ns = rig.ports.clock.now_ns
    return policy


def write_evaluation(
    config: RunConfig,
    folder: RunFolder,
    name: str,
    document: PolicyDocument | None,
    rows: Sequence[TrialRow],
    trials: int,
    claim: Claim | None = None,
) -> dict[str, Any]:
    """Write ``summary.json``, times and forces as a picture, and the policy; gives the figures of the summary."""
    summary = policy_summary(config, name, rows, trials)
    if claim is not None:
        verdict = claim.verdict(sum(row.success for row in rows), len(rows))
        summary |= {"claim": str(claim), "verdict": verdict}
    folder.write_json("summary.json", summary)
    folder.write("trials.png", trials_picture(rows, f"{_who(config, name)}, {config.scenario}"))
    if document is not None:
        document.save(folder.path / "policy.json")
    return summary


def _who(config: RunConfig, policy: str) -> str:
    """What ran: a policy, or the task by itself."""
    return config.task.name if policy == NO_POLICY else policy


def true_hole_m(rig: Rig) -> Sequence[float]:
    """Where the hole really is, and how it is turned: as :func:`pose_of` gives it."""
    truth = rig.truth()
    if truth is None:
        raise ConfigurationError("policy", "omniscient", NOBODY_KNOWS)
    return pose_of(truth.hole_in_task_m, truth.hole_turn_rad, truth.drawn)


def warm_up(config: RunConfig, ready: ReadyPose) -> TrialReport:
    """Run one whole trial in the simulator, with parts of its own, so that nothing of it reaches the run.

    Late imports, caches and the interpreter's own adaptation then do not fall on the first ticks of a real arm.
    """
    # What each log states: found out once, which takes up to half a second, in which no other thread runs.
    for stated in (made_with, processor, core_sha256):
        stated()
    with SimulatedRig(config, ready) as rig:
        rig.prepare(0)
        name = "torque" if task_kind(config.task.name).asks_policy else NO_POLICY
        policy = comparator(name, config, lambda: rig.truth().hole_in_task_m)
        task = build_task(config, ready, plain_perception(config), policy)
        return run_trial(task, rig.ports, trial_setup(config, 0), supervisor_of(rig, config, ready))
