"""What programmed knowledge and examples have in common: one fixed action for some of the states."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.policy.actions import Action
from palpate.core.policy.base import Decision, Observation, Policy, Transition, check_names


class AssignedPolicy(Policy):
    """Always takes the action assigned to a state; serves only the states that have one.

    Args:
        states: Names of the states.
        actions: The action set.
        assigned: Index of each state's action, or None, (n states,).
        source: Which knowledge this is, as decisions will say.
    """

    def __init__(
        self, states: Sequence[str], actions: Sequence[Action], assigned: Sequence[int | None], source: str
    ) -> None:
        check_names(states, actions)
        self.states, self.actions, self.source = tuple(states), tuple(actions), source
        self._assigned = tuple(assigned)

    @property
    def temperature(self) -> float | None:
        """None: nothing here is random."""
        return None

    def assigned(self, state: int) -> int | None:
        """Index of the action of a state; None where there is none."""
        return self._assigned[state]

    def serves(self, state: int) -> bool:
        """Whether the state has an action."""
        return self._assigned[state] is not None

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """Nothing to do; takes no random number."""

    def choose(self, observation: Observation) -> Decision:
        """The action of the state.

        Raises:
            ConfigurationError: The state has none.
        """
        index = self._assigned[observation.state]
        if index is None:
            accepted = "an action for every state that occurs, or a learner beside it in a mixed policy"
            raise ConfigurationError(f"policy.{self.source}", self.states[observation.state], accepted)
        return Decision(self.actions[index], index, self.source)

    def learn(self, transition: Transition) -> None:
        """Ignored: this knowledge is fixed."""


def check_known(field: str, state: str, action: str, states: Sequence[str], actions: Sequence[Action]) -> None:
    """Refuse a pair of names that the task does not have.

    Args:
        field: Where the pair was written.
        state: Name of a state.
        action: Name of an action.
        states: The names that are accepted.
        actions: The actions that are accepted.

    Raises:
        ConfigurationError: Naming ``field`` and all that is accepted.
    """
    if state not in states:
        raise ConfigurationError(field, state, f"a state of this task: {', '.join(states)}")
    names = [known.name for known in actions]
    if action not in names:
        raise ConfigurationError(field, action, f"for state {state!r} an action of: {', '.join(names)}")
