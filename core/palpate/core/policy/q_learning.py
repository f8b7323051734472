"""Tabular Q-learning with Boltzmann exploration (paper, sections 5.5 and 6)."""

from __future__ import annotations

from palpate.core.policy.base import Transition
from palpate.core.policy.tabular import TabularLearner


class QLearning(TabularLearner):
    """Learns ``Q(i, a) <- (1 - alpha) Q(i, a) + alpha (r + gamma V(j))``, with ``V(j) = max_a Q(j, a)``.

    The value of the goal is 0. Where another policy is bound to act in ``j`` (see
    :class:`~palpate.core.policy.mixed.MixedPolicy`), ``V(j)`` is the Q of that policy's action.
    """

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
        values = self._values(transition.next_state)
        bound = transition.next_action_index
        return max(values) if bound is None else values[bound]
