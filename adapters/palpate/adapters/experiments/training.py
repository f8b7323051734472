"""One run from configuration to results: trials in order, a checkpoint after each, a clean end on request."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from palpate.adapters.config import RUN_FORMAT, RunConfig, to_toml
from palpate.adapters.experiments.build import build_task, supervisor_of
from palpate.adapters.experiments.figure import learning_curve
from palpate.adapters.experiments.policies import perception_settings
from palpate.adapters.experiments.results import RunFolder, TrialRow
from palpate.adapters.experiments.statistics import training_summary
from palpate.adapters.experiments.trial import (
    OVERLOADS,
    ScoredTrial,
    interrupting,
    require_sound,
    rest_reinforcement,
    run_scored_trial,
)
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.adapters.log import TrialRecorder, made_with
from palpate.core.errors import ConfigurationError, OutputError
from palpate.core.perception import Perception, perception_to_dict
from palpate.core.policy import Policy, TabularLearner, Transition, document_of, learner_of
from palpate.core.ports import Rig, json_of_file
from palpate.core.trial import Outcome, ReadyPose


@dataclass(frozen=True)
class Checkpoint:
    """Where a training run stands.

    Attributes:
        learner: The learner's state after them.
        clock_ticks: Control ticks on the world's clock, which goes on from there.
    """

    next_trial: int
    learner: dict[str, Any]
    perception: dict[str, Any]
    clock_ticks: int

    def save(self, folder: RunFolder) -> None:
        """Write it into the folder, whole."""
        # After every trial: waiting for the disk would take a twentieth of a simulated one.
        folder.write_json("checkpoint.json", vars(self), durable=False)

    @classmethod
    def load(cls, folder: RunFolder) -> Checkpoint:
        """Read it back.

        Raises:
            OutputError: There is none, or it is damaged.
        """
        path = folder.path / "checkpoint.json"
        try:
            content = json_of_file(path)
            return cls(
                int(content["next_trial"]),
                dict(content["learner"]),
                dict(content["perception"]),
                int(content["clock_ticks"]),
            )
        except (OSError, ValueError, OverflowError, KeyError, TypeError) as error:
            raise OutputError(str(path), f"is no checkpoint to resume from ({error})", "begin a new run") from error


def run_toml(config: RunConfig, command: str, **facts: Any) -> str:
    """The text of ``run.toml``: the resolved configuration, and how it came about; ``--config`` takes it again."""
    lines = [to_toml(config), "\n[run]\n", f"format = {json.dumps(RUN_FORMAT)}\ncommand = {json.dumps(command)}\n"]
    facts = {"part": config.part.describe(), **facts}
    lines += [f"{name} = {json.dumps(value, ensure_ascii=False)}\n" for name, value in facts.items()]
    lines += ["\n[run.versions]\n", *(f"{name} = {json.dumps(v)}\n" for name, v in made_with().items())]
    return "".join(lines)


def write_training(config: RunConfig, folder: RunFolder, trials: int) -> tuple[list[TrialRow], dict[str, Any]]:
    """Write ``summary.json`` and the learning curve; gives the finished trials and the figures of the summary."""
    rows = folder.read_trials()
    summary = training_summary(config, rows, trials)
    folder.write_json("summary.json", summary)
    title = f"Peg in hole, {config.arm}, scenario {config.scenario}, seed {config.seed}"
    folder.write("learning_curve.png", learning_curve(rows, title))
    return rows, summary


class Trainer:
    """Trains a policy, trial by trial, into a run folder."""

    def __init__(
        self,
        config: RunConfig,
        folder: RunFolder,
        ready: ReadyPose,
        rig: Rig,
        perception: Perception,
        policy: Policy,
        next_trial: int = 0,
        recorder: TrialRecorder | None = None,
        session: RealTimeSession | None = None,
    ) -> None:
        learner = learner_of(policy)
        if learner is None:
            raise ConfigurationError("policy", type(policy).__name__, "a policy with a learner")
        self._config, self._folder, self._rig = config, folder, rig
        self._perception, self._policy, self._learner = perception, policy, learner
        self._perception_dict = perception_to_dict(perception)
        self._task = build_task(config, ready, perception, policy)
        self._supervisor = supervisor_of(rig, config, ready)
        self._recorder, self._session = recorder, session
        if recorder is not None:
            recorder.of("train", config, ready, self._task, perception, policy, frozen=False)
        self.next_trial = next_trial
        self.interrupted = False

    def train(self, trials: int, on_trial: Callable[[ScoredTrial], None]) -> None:
        """Run trials up to number ``trials``; returns early, and sets ``interrupted``, on Ctrl-C.

        A trial that is cut short leaves no trace: the learner goes back to where it was, so that resuming gives
        what an uninterrupted run would have given.
        """
        with interrupting(self._request_end):
            while self.next_trial < trials and not self.interrupted:
                before, ticks = self._learner.get_state(), self._rig.clock_ticks
                scored = run_scored_trial(
                    self._config,
                    self._rig,
                    self._task,
                    self.next_trial,
                    self._recorder,
                    supervisor=self._supervisor,
                    session=self._session,
                )
                if scored.report.outcome is Outcome.INTERRUPTED:
                    self._learner.set_state(before)
                    self._rig.set_clock_ticks(ticks)
                    break
                if scored.marked and not self._config.admission.learn_from_marked:
                    self._learner.set_state(before)
                elif scored.trip:
                    self._learn_from_trip(scored, before)
                self._folder.append_trial(scored)
                # No further than here: what was learned of it must not stay, and a resumed run repeats it.
                require_sound(self._rig, scored)
                self.next_trial += 1
                self.checkpoint()
                on_trial(scored)

    def _learn_from_trip(self, scored: ScoredTrial, before: dict[str, Any]) -> None:
        """Keep of a tripped trial, which is an episode without an end, what its actions caused.

        Where a sensor may have failed, every transition of the trial may be wrong: the learner goes back to where it
        was. An exceeded limit is a consequence of the last action. A table of Q charges it with the rest of the time
        limit, for an action that costs nothing more would be tried again and again; other learners know nothing of
        costs and keep the actions that were finished.
        """
        report = scored.report
        if report.trip is None or report.trip.reason not in OVERLOADS:
            self._learner.set_state(before)
        elif isinstance(self._learner, TabularLearner) and report.decisions:
            last, cost = report.decisions[-1], rest_reinforcement(self._config, report.exploration_time_s)
            if last.index is not None:
                state = self._perception.states.index(last.state)
                self._learner.learn(Transition(state, last.index, cost, None))

    def checkpoint(self) -> None:
        """Save what a resumed run starts from."""
        ticks = self._rig.clock_ticks
        Checkpoint(self.next_trial, self._learner.get_state(), self._perception_dict, ticks).save(self._folder)

    def save_policy(self) -> None:
        """Write ``policy.json``."""
        settings = perception_settings(self._config, self._perception)
        document = document_of(self._policy, created_with=made_with(), perception=settings)
        document.save(self._folder.path / "policy.json")

    def _request_end(self) -> None:
        self.interrupted = True
        self._task.interrupt()


def resume_from(checkpoint: Checkpoint, policy: Policy, rig: Rig) -> None:
    """Put a policy's learner, and the world's clock, to where the checkpoint left them."""
    rig.set_clock_ticks(checkpoint.clock_ticks)
    learner = learner_of(policy)
    if learner is None:
        raise ConfigurationError("policy", type(policy).__name__, "a policy with a learner")
    try:
        learner.set_state(checkpoint.learner)
    except (KeyError, TypeError, ValueError) as error:
        raise OutputError("checkpoint.json", f"holds no state of this learner ({error})", "begin a new run") from error
