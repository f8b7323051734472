"""Tabular Q-learning with Boltzmann exploration (paper, sections 5.5 and 6)."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.core.policy.actions import Action
from palpate.core.policy.base import Transition
from palpate.core.policy.exploration import TemperatureSchedule
from palpate.core.policy.tabular import QParameters, TabularLearner


class QLearning(TabularLearner):
    """Learns ``Q(i, a) <- (1 - alpha) Q(i, a) + alpha (r + gamma V(j))``, with ``V(j) = max_a Q(j, a)``.

    The value of the goal is 0. Where another policy is bound to act in ``j`` (see
    :class:`~palpate.core.policy.mixed.MixedPolicy`), ``V(j)`` is the Q of that policy's action.

    Args:
        states: Names of the states.
        actions: The action set.
        alpha: See :class:`QParameters`, as for the next five.
        gamma: Discount.
        temperature: Temperature of the exploration.
        alpha_visits: Visits that halve the learning rate.
        alpha_floor: Lowest learning rate.
        initial_value: Q before the first visit.
        frozen: Learn nothing, and keep the temperature at ``frozen_temperature``.
        frozen_temperature: Temperature while frozen; None takes the floor of the schedule.

    Raises:
        ConfigurationError: A value is out of its range, or names repeat.
    """

    def __init__(
        self,
        states: Sequence[str],
        actions: Sequence[Action],
        *,
        alpha: float,
        gamma: float = 1.0,
        temperature: TemperatureSchedule,
        alpha_visits: float | None = None,
        alpha_floor: float = 0.0,
        initial_value: float = 0.0,
        frozen: bool = False,
        frozen_temperature: float | None = None,
    ) -> None:
        parameters = QParameters(
            alpha=alpha,
            gamma=gamma,
            temperature=temperature,
            alpha_visits=alpha_visits,
            alpha_floor=alpha_floor,
            initial_value=initial_value,
        )
        super().__init__(states, actions, parameters, frozen=frozen, frozen_temperature=frozen_temperature)

    def learn(self, transition: Transition) -> None:
        """Update the Q of one state and action, unless frozen."""
        if self.frozen:
            return
        state, action = transition.state, transition.action_index
        alpha = self.parameters.learning_rate(self._visits[state][action])
        target = transition.reinforcement + self.parameters.gamma * self._value_after(transition)
        self._q[state][action] = (1.0 - alpha) * self._q[state][action] + alpha * target
        self._count(state, action)

    def _value_after(self, transition: Transition) -> float:
        if transition.next_state is None:
            return 0.0
        values = self._q[transition.next_state]
        bound = transition.next_action_index
        return max(values) if bound is None else values[bound]
