"""Policy training: trials in order, with a checkpoint after each one and a clean stop on request."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, Final

from palpate.adapters.config import LEARNERS, RUN_FORMAT, RunConfig, overlay, read_toml, run_facts, task_kind, to_toml
from palpate.adapters.experiments.documents import save_policy
from palpate.adapters.experiments.figure import learning_curve
from palpate.adapters.experiments.fitting import configured_perception
from palpate.adapters.experiments.policies import (
    first_difference,
    learning_policy,
    loaded_policy,
    perception_of,
    perception_settings,
    policy_named,
)
from palpate.adapters.experiments.results import RunFolder, TrialRow
from palpate.adapters.experiments.statistics import learning_summary, run_summary
from palpate.adapters.experiments.third_party import third_party_entry
from palpate.adapters.experiments.trial import OVERLOADS, ScoredTrial, require_sound, rest_reinforcement
from palpate.adapters.experiments.trials import NOT_RECORDED, Recording, Trials
from palpate.adapters.files import json_of_file
from palpate.adapters.log import LOG_FOLDER, made_with, set_aside
from palpate.core.control_loop import LoopObserver
from palpate.core.errors import ConfigurationError, OutputError
from palpate.core.perception import Perception, perception_from_dict, perception_to_dict
from palpate.core.policy import Policy, PolicyDocument, TabularLearner, Transition, document_of, learner_of
from palpate.core.ports import Rig
from palpate.core.trial import Outcome, ReadyPose

_TRAINED: Final = "q-learning, a policy file, or package.module:Name"


def run_toml(config: RunConfig, command: str, **facts: Any) -> str:
    """Return the text of ``run.toml``: the resolved configuration and data about the run; ``--config`` accepts it."""
    lines = [to_toml(config), "\n[run]\n", f"format = {json.dumps(RUN_FORMAT)}\ncommand = {json.dumps(command)}\n"]
    facts = {"part": config.part.describe(), **facts}
    lines += [f"{name} = {json.dumps(value, ensure_ascii=False)}\n" for name, value in facts.items()]
    lines += ["\n[run.versions]\n", *(f"{name} = {json.dumps(v)}\n" for name, v in made_with().items())]
    return "".join(lines)


def write_training(config: RunConfig, folder: RunFolder, trials: int) -> tuple[list[TrialRow], dict[str, Any]]:
    """Write ``summary.json`` and the learning curve; return the finished trials and the values in the summary."""
    rows = folder.read_trials()
    summary = run_summary(config, rows, trials) | {"learning": learning_summary(rows)}
    folder.write_json("summary.json", summary)
    title = f"Peg in hole, {config.arm}, scenario {config.scenario}, seed {config.seed}"
    folder.write("learning_curve.png", learning_curve(rows, title))
    return rows, summary


@dataclass(frozen=True)
class Checkpoint:
    """State of a training run: the learner after the finished trials, the perception, and the world's control ticks."""

    next_trial: int
    learner: dict[str, Any]
    perception: dict[str, Any]
    clock_ticks: int

    def save(self, folder: RunFolder) -> None:
        """Write the checkpoint into the folder atomically."""
        # Written after every trial; waiting for the disk would take 5 % of the duration of a simulated trial.
        folder.write_json("checkpoint.json", vars(self), durable=False)

    @classmethod
    def load(cls, folder: RunFolder) -> Checkpoint:
        """Read the checkpoint in a folder.

        Raises:
            OutputError: The checkpoint is missing or damaged.
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
        except FileNotFoundError as error:
            raise OutputError(str(path), "is missing, so there is nothing to resume", "begin a new run") from error
        except (OSError, ValueError, OverflowError, KeyError, TypeError) as error:
            raise OutputError(str(path), f"is no checkpoint to resume from ({error})", "begin a new run") from error


def resume_from(checkpoint: Checkpoint, policy: Policy, rig: Rig) -> None:
    """Restore a policy's learner and the world's clock from a checkpoint."""
    rig.set_clock_ticks(checkpoint.clock_ticks)
    learner = learner_of(policy)
    if learner is None:
        raise ConfigurationError("policy", type(policy).__name__, "a policy with a learner")
    try:
        learner.set_state(checkpoint.learner)
    except (KeyError, TypeError, ValueError) as error:
        raise OutputError("checkpoint.json", f"holds no state of this learner ({error})", "begin a new run") from error


def require_same_run(config: RunConfig, policy: str, folder: RunFolder) -> None:
    """Check that a folder's run started with this configuration, policy and software.

    Raises:
        ConfigurationError: One of them differs.
    """
    path = folder.path / "run.toml"
    table = read_toml(path)
    facts = run_facts(table, path)
    begun = {"policy": facts.get("policy"), "run.versions": facts.get("versions")}
    now = {"policy": policy, "run.versions": made_with()}
    settings = {"resume": asdict(config)}, {"resume": asdict(overlay(RunConfig(), table))}
    for ours, theirs in ((now, begun), settings):
        if ours != theirs:
            name, value, before = first_difference(ours, theirs)
            name = name.removeprefix("resume.")
            raise ConfigurationError(name, value, f"{before!r}, with which the run in {folder.path} began")


def cut_back(folder: RunFolder, first: int) -> None:
    """Remove the data after the checkpoint from a folder.

    Raises:
        OutputError: A trial before the checkpoint is missing.
    """
    folder.truncate(first)
    set_aside(folder.path / LOG_FOLDER, first)
    if len(folder.read_trials()) != first:
        missing = f"does not hold the {first} finished trials"
        raise OutputError(str(folder.path / "trials.csv"), missing, "begin a new run")


@dataclass(frozen=True)
class Subject:
    """The policy or learner to train, with its name in the run folder, and its policy file or code, if any."""

    name: str
    document: PolicyDocument | None
    code: str

    @classmethod
    def of(cls, config: RunConfig, policy: str) -> Subject:
        """Return the subject with this name; an empty name means the configured learner.

        Raises:
            ConfigurationError: The policy cannot be trained.
        """
        if policy in LEARNERS and policy not in ("q-learning", config.learner):
            raise ConfigurationError("policy", policy, f"a policy file; --learner {policy} chooses it")
        name = config.learner if policy in ("", *LEARNERS) else policy
        asks = task_kind(config.task.name).queries_policy
        config.task.require("name", asks, "a task that lets a policy choose; this one asks none")
        document, code = (None, "") if name == config.learner else policy_named(name, _TRAINED)
        brought = config.learning.programmed or config.learning.examples
        if (document is not None or code) and brought:
            accepted = "empty, without examples, for --policy FILE or package.module:Name, which has its own"
            raise ConfigurationError("learning.programmed", brought, accepted)
        if code:
            third_party_entry(code)
        return cls(name, document, code)

    def perception(self, config: RunConfig, checkpoint: Checkpoint | None) -> Perception | None:
        """Return the perception, or None if it must be fitted."""
        perception = configured_perception(config)
        if self.document is not None:
            perception = perception_of(self.document, config, perception)
        return perception if checkpoint is None else perception_from_dict(checkpoint.perception)

    def policy(self, config: RunConfig, perception: Perception) -> Policy:
        """Return the policy before its first trial.

        Raises:
            ConfigurationError: The policy does not learn.
        """
        if self.document is not None:
            policy = loaded_policy(self.document, config, perception, frozen=False)
        else:
            policy = learning_policy(config, perception, self.code)
        if learner_of(policy) is None:
            accepted = "a policy that offers what it has learned, by get_state and set_state"
            raise ConfigurationError("policy", self.name, accepted)
        return policy


class Trainer(Trials):
    """Trainer that trains a policy and records each trial in a run folder."""

    def __init__(
        self,
        config: RunConfig,
        folder: RunFolder,
        ready: ReadyPose,
        rig: Rig,
        perception: Perception,
        policy: Policy,
        next_trial: int = 0,
        recording: Recording = NOT_RECORDED,
    ) -> None:
        learner = learner_of(policy)
        if learner is None:
            raise ConfigurationError("policy", type(policy).__name__, "a policy with a learner")
        self._folder, self._learner, self._perception_dict = folder, learner, perception_to_dict(perception)
        self.next_trial = next_trial
        super().__init__(config, ready, rig, perception, policy, recording, command="train")

    def train(self, trials: int, on_trial: Callable[[ScoredTrial], object]) -> None:
        """Run trials until a total of ``trials`` are finished. On Ctrl-C, return early and set ``interrupted``."""

        def done(scored: ScoredTrial) -> None:
            self._folder.append_trial(scored)
            # Stop here. Nothing learned in this trial may be saved, because a resumed run repeats the trial.
            require_sound(self.rig, scored)
            self.next_trial += 1
            self.checkpoint()
            on_trial(scored)

        self.run_all(range(self.next_trial, trials), done)

    def run(self, number: int, watching: tuple[LoopObserver, ...] = ()) -> ScoredTrial:
        """Run one trial and learn from it; an interrupted trial leaves the learner's state unchanged."""
        before, ticks = self._learner.get_state(), self.rig.clock_ticks
        scored = super().run(number, watching)
        if scored.report.outcome is Outcome.INTERRUPTED:
            self._learner.set_state(before)
            self.rig.set_clock_ticks(ticks)
        elif scored.flagged and not self.config.acceptance.learn_from_flagged:
            self._learner.set_state(before)
        elif scored.trip:
            self._learn_from_trip(scored, before)
        return scored

    def _learn_from_trip(self, scored: ScoredTrial, before: dict[str, Any]) -> None:
        """Learn from the actions in a tripped trial, or forget it if a failed sensor may have spoilt it."""
        report = scored.report
        if report.trip is None or report.trip.reason not in OVERLOADS:
            self._learner.set_state(before)
        elif isinstance(self._learner, TabularLearner) and report.decisions:
            # Without this cost, the action that exceeded the limit would be tried again and again.
            last, cost = report.decisions[-1], rest_reinforcement(self.config, report.exploration_time_s)
            if last.index is not None:
                state = self.perception.states.index(last.state)
                self._learner.learn(Transition(state, last.index, cost, None))

    def checkpoint(self) -> None:
        """Save the state from which a resumed run starts."""
        ticks = self.rig.clock_ticks
        Checkpoint(self.next_trial, self._learner.get_state(), self._perception_dict, ticks).save(self._folder)

    def save_policy(self) -> None:
        """Write ``policy.json``."""
        settings = perception_settings(self.config, self.perception)
        document = document_of(self.policy, created_with=made_with(), perception=settings)
        save_policy(document, self._folder.path / "policy.json")
