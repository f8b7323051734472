"""Contacts in recorded trials with any policy, and a belief learned from them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from typing_extensions import override

from palpate.adapters.config import LEARNERS, RunConfig, overlay
from palpate.adapters.experiments import configured_perception, learning_policy, perception_settings, tool_of
from palpate.adapters.log import config_of, json_in, made_with, read_log
from palpate.adapters.replay.engine import Verdict, replay
from palpate.adapters.replay.rebuild import Rebuilder
from palpate.core.errors import ConfigurationError, LogError, one_line
from palpate.core.perception import perception_from_dict
from palpate.core.policy import (
    Decision,
    EpisodeOutcome,
    LearnerEntry,
    Observation,
    Policy,
    PolicyDocument,
    Transition,
    document_of,
)
from palpate.core.policy.belief import MIN_CONTACTS, ContactObservation, ContactTrial


class ContactCollector(Policy):
    """Policy wrapper that collects the contacts of each trial that ends in the hole."""

    def __init__(self, policy: Policy, trials: list[ContactTrial]) -> None:
        self._policy, self._trials = policy, trials
        self._contacts: list[ContactObservation] = []

    @property
    @override
    def temperature(self) -> float | None:
        return self._policy.temperature

    @override
    def serves(self, state: int) -> bool:
        return self._policy.serves(state)

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        self._contacts = []
        self._policy.begin_trial(trial, rng)

    @override
    def choose(self, observation: Observation) -> Decision:
        self._contacts.append(ContactObservation.of(observation))
        return self._policy.choose(observation)

    @override
    def learn(self, transition: Transition) -> None:
        self._policy.learn(transition)

    @override
    def end_trial(self, episode: EpisodeOutcome) -> None:
        if episode.inserted:
            self._trials.append(ContactTrial.of(episode, self._contacts))
        self._policy.end_trial(episode)


@dataclass(frozen=True)
class FoundContacts:
    """Contacts in recorded trials, the first trial's settings, and the policy file for a belief learned from them."""

    config: RunConfig
    document: PolicyDocument
    inserted: int
    left_out: tuple[str, ...]


def contacts_of(paths: Sequence[Path], gone_through: Callable[[], object]) -> FoundContacts:
    """Return the contacts in logs from the same tool, in the order in which they were learned.

    The core is replayed on each log, so the trials may be from any policy.

    Raises:
        ConfigurationError: The logs are from different tools, or contain too few contacts.
        LogError: The first log cannot be read.
    """
    trials: list[ContactTrial] = []
    rebuilder = Rebuilder(around=lambda policy: ContactCollector(policy, trials))
    first = read_log(paths[0])
    recorded, left_out = config_of(first), list[str]()
    for path in paths:
        before = len(trials)
        try:
            log = read_log(path)
            _require_same_tool(recorded, config_of(log), path)
            came_to = replay(log, rebuilder)
        except LogError as error:
            left_out.append(one_line(error))
        else:
            if came_to.verdict is Verdict.DIVERGED:
                # Actions that differ from the recording were never executed.
                del trials[before:]
                left_out.append(f"{path}: does not replay: {came_to.first}")
        gone_through()
    found = sum(len(trial.contacts) for trial in trials)
    if found < MIN_CONTACTS:
        count = f"{found} in {len(trials)} trials that ended in the hole, of {len(paths)} logs"
        raise ConfigurationError("contacts", count, f"at least {MIN_CONTACTS}")
    config = recorded
    if config.learner != "belief":
        config = overlay(replace(recorded, learner="belief"), LEARNERS["belief"])
    perception = configured_perception(config)
    if perception is None:
        # Its stages were fitted when that trial was recorded.
        perception = perception_from_dict(json_in(first, "start.perception_json", first.start.perception_json))
    remembered = trials[-config.learning.belief.memory_trials :]
    learned = {"trials": [trial.to_dict() for trial in remembered], "trials_learned": len(trials)}
    belief = LearnerEntry("belief", config.learning.belief, learned)
    document = document_of(
        learning_policy(config, perception),
        created_with=made_with(),
        perception=perception_settings(config, perception),
    )
    return FoundContacts(config, replace(document, learner=belief), len(trials), tuple(left_out))


def _require_same_tool(first: RunConfig, config: RunConfig, path: Path) -> None:
    """Reject a log from a different tool, for which torques have a different meaning."""
    wanted, there = (
        {**tool_of(each), "perception.calibration": each.perception.calibration} for each in (first, config)
    )
    for name, value in there.items():
        if value != wanted.get(name):
            raise ConfigurationError(name, value, f"{wanted.get(name)!r}, as in the first log; not so in {path}")
