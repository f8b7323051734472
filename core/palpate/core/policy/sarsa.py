"""Tabular Sarsa(lambda) with replacing traces.

If different positions map to the same state, one-step Q-learning may miss even the best memoryless policy.
Sarsa(lambda) often finds it (Loch and Singh 1998), so it is the baseline for policies with memory.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from palpate.core.policy.base import Action, Decision, Observation, Transition
from palpate.core.policy.tabular import QParameters, TabularLearner
from palpate.core.ports import Range, fitted, require_keys


@dataclass(frozen=True, slots=True, kw_only=True)
class SarsaParameters(QParameters):
    """Settings for Sarsa(lambda): those of :class:`~palpate.core.policy.tabular.QParameters` and the trace decay."""

    trace_decay: Annotated[float, Range(0.0, 1.0)] = 0.9
    """Lambda: fraction of credit that an action gets for later steps. 0 gives one-step Sarsa; 1 without a discount
    credits the rest of the trial."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OptionParameters(SarsaParameters):
    """Settings for learning with options, which uses Sarsa so that the end of a trial rewards all of its options."""


class Sarsa(TabularLearner):
    """Sarsa learner: ``Q(i, a) <- Q(i, a) + alpha e(i, a) delta``, with ``delta = r + gamma Q(j, b) - Q(k, c)``.

    ``k, c`` is the step just made, ``j, b`` the step after it, and ``e`` the trace of each pair: 1 for the pair just
    tried, 0 for the other actions in its state from then on, decayed by ``gamma lambda`` at every step.

    The action ``b`` is drawn as soon as its state is known, so that nothing is left to learn at the end of a trial;
    ``choose`` then returns it. The value of the goal is 0. If another policy acts in ``j``, ``b`` is its action.

    Raises:
        ConfigurationError: A value is out of range, or a name is repeated.
    """

    parameters: SarsaParameters

    def __init__(
        self,
        states: Sequence[str],
        actions: Sequence[Action],
        parameters: SarsaParameters,
        *,
        frozen: bool = False,
    ) -> None:
        super().__init__(states, actions, parameters, frozen=frozen)
        # At most one pair per state has a trace: its action, and the remaining trace.
        self._traces: dict[int, tuple[int, float]] = {}
        self._next: tuple[int, int] | None = None

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """Begin a trial as for any tabular learner, and clear the traces."""
        super().begin_trial(trial, rng)
        self._traces, self._next = {}, None

    def choose(self, observation: Observation) -> Decision:
        """Return the action drawn for this state during learning, or draw one, with one random number per choice."""
        drawn, self._next = self._next, None
        if drawn is not None and drawn[0] == observation.state:
            return self._decision(drawn[1])
        return super().choose(observation)

    def _value(self, state: int, transition: Transition) -> float:
        index = transition.next_action_index
        if index is None:
            index = self._drawn(state)
            self._next = (state, index)
        return self._q[state][index]

    def _update(self, state: int, action: int, target: float) -> None:
        delta = target - self._q[state][action]
        fading = self.parameters.gamma * self.parameters.trace_decay
        self._traces[state] = (action, 1.0)
        for i, (a, trace) in self._traces.items():
            self._q[i][a] += self.parameters.learning_rate(self._visits[i][a]) * trace * delta
            self._traces[i] = (a, fading * trace)

    def get_state(self) -> dict[str, Any]:
        """Return the tabular learner's state, including the traces."""
        traces = [[state, action, trace] for state, (action, trace) in self._traces.items()]
        return super().get_state() | {"traces": traces, "next": None if self._next is None else list(self._next)}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Restore the state returned by :meth:`get_state`."""
        require_keys("learner", state, tuple(self.get_state()))
        traces = fitted("learner.traces", state["traces"], tuple[tuple[int, int, float], ...])
        drawn = fitted("learner.next", state["next"], tuple[int, int] | None)
        super().set_state(state)
        self._traces = {i: (action, trace) for i, action, trace in traces}
        self._next = drawn
