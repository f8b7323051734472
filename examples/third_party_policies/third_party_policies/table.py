"""A tabular learner that estimates the cost of each action in each state, and usually takes the cheapest action."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from palpate.core.policy import Decision, FixedPolicy, Observation, PolicyContext, Transition

RATE, EXPLORED = 0.2, 0.1


class Table(FixedPolicy):
    """One-step Q-learning over the states and the action set of the task."""

    def __init__(self, context: PolicyContext) -> None:
        super().__init__()
        self._actions = context.actions
        self._q = np.zeros((len(context.states), len(context.actions)))

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        self._rng = rng

    def choose(self, observation: Observation) -> Decision:
        index = int(self._q[observation.state].argmax())
        if self._rng.random() < EXPLORED:
            index = int(self._rng.integers(len(self._actions)))
        # With an index the action is one of the set, and learn() follows.
        return Decision(self._actions[index], index, "table")

    def learn(self, transition: Transition) -> None:
        """Update the table between two choices. The value of the goal, for which next_state is None, is 0."""
        ahead = 0.0 if transition.next_state is None else float(self._q[transition.next_state].max())
        at = transition.state, transition.action_index
        self._q[at] += RATE * (transition.reinforcement + ahead - self._q[at])

    def get_state(self) -> dict[str, Any]:
        return {"q": self._q.tolist()}

    def set_state(self, state: Mapping[str, Any]) -> None:
        q = np.array(state["q"], dtype=float)
        if q.shape != self._q.shape:
            raise ValueError(f"a table of {q.shape}, not {self._q.shape}")
        self._q = q
