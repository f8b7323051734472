"""Programmed, exemplary and learned knowledge side by side, state by state (paper, sections 3.5 and 7)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.policy.assigned import AssignedPolicy
from palpate.core.policy.base import Decision, Observation, Policy, Transition


class MixedPolicy(Policy):
    """In each state the first part that serves it decides.

    Every part hears of every transition, whoever chose the action: Q-learning is off-policy, and a
    learner needs the value of the states that others decide, to judge the actions that lead there. In
    those states it must not take the best of all actions for that value: the ones that are never tried
    would keep their initial 0, and the state would look as good as the goal. So where the next state
    belongs to a part with a fixed action, the transition says so in ``next_action_index``.

    Args:
        states: Names of the states.
        parts: Policies over these states and one action set, the most trusted first.

    Raises:
        ConfigurationError: Nobody serves some state.
    """

    def __init__(self, states: Sequence[str], parts: Sequence[Policy]) -> None:
        self.states, self.parts = tuple(states), tuple(parts)
        orphans = [name for state, name in enumerate(self.states) if not any(p.serves(state) for p in self.parts)]
        if orphans:
            accepted = "a part that serves each state: add entries, or a learner as the last part"
            raise ConfigurationError("policy.mixed", ", ".join(orphans), accepted)

    @property
    def temperature(self) -> float | None:
        """Temperature of the first part that has one."""
        return next((part.temperature for part in self.parts if part.temperature is not None), None)

    def part_for(self, state: int) -> Policy:
        """The part that decides in a state.

        Raises:
            ConfigurationError: None of them serves it (any more).
        """
        for part in self.parts:
            if part.serves(state):
                return part
        raise ConfigurationError("policy.mixed", self.states[state], "a part that serves this state")

    def serves(self, state: int) -> bool:
        """Whether any part serves it."""
        return any(part.serves(state) for part in self.parts)

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """Begin the trial in every part; they share ``rng``."""
        for part in self.parts:
            part.begin_trial(trial, rng)

    def choose(self, observation: Observation) -> Decision:
        """What the part in charge of the state chooses.

        Raises:
            ConfigurationError: Nobody serves the state.
        """
        return self.part_for(observation.state).choose(observation)

    def learn(self, transition: Transition) -> None:
        """Tell every part."""
        if transition.next_state is not None:
            owner = self.part_for(transition.next_state)
            if isinstance(owner, AssignedPolicy):
                transition = replace(transition, next_action_index=owner.assigned(transition.next_state))
        for part in self.parts:
            part.learn(transition)
