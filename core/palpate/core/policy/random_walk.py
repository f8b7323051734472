"""The comparator that knows nothing: every action is as likely as any other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.policy.actions import Action
from palpate.core.policy.base import Decision, Observation, Policy, Transition, drawing_from


class RandomWalkPolicy(Policy):
    """Draws each action uniformly; exactly one random number a choice.

    Args:
        actions: The action set.

    Raises:
        ConfigurationError: There is no action.
    """

    def __init__(self, actions: Sequence[Action]) -> None:
        if not actions:
            raise ConfigurationError("policy.actions", tuple(actions), "at least one action")
        self.actions = tuple(actions)
        self._rng: np.random.Generator | None = None

    @property
    def temperature(self) -> float | None:
        """None: it is always as random as can be."""
        return None

    def serves(self, state: int) -> bool:
        """True for every state."""
        return True

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """Take the random numbers of the trial from ``rng``."""
        self._rng = rng

    def choose(self, observation: Observation) -> Decision:
        """Any action.

        Raises:
            LifecycleError: No trial has begun.
        """
        index = int(drawing_from(self._rng, "random walk").random() * len(self.actions))
        return Decision(self.actions[index], index, "random")

    def learn(self, transition: Transition) -> None:
        """Ignored."""
