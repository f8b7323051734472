"""Backing off: where a state was little tried, what its last symbol has taught stands in for it.

A memory makes many states of few symbols, and each must be filled with experience of its own; so a learner with a
memory is slower at first than one without, although it never holds less. Here Q is learned for symbols beside Q for
states, from the same experience, and both are weighed by how often the state was tried: at first the symbol counts, in
the end the state. Language models back off to shorter contexts in the same way (Jelinek and Mercer, 1980).
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Self

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Action, Transition
from palpate.core.policy.tabular import QLearning, QParameters
from palpate.core.ports import Range, Settings


@dataclass(frozen=True, slots=True)
class BackOff(Settings):
    """From states to the symbols that stand in for them."""

    TABLE: ClassVar[str] = "policy.back_off"

    visits: Annotated[float, Range(0.0, above=True)]
    """After so many visits of a state-action pair its own Q and that of the symbol count alike."""
    symbol_of: tuple[Annotated[int, Range(0)] | None, ...]
    """For each state the number of its symbol, (states,); None where nothing stands in for it."""

    @classmethod
    def of(cls, visits: float, symbol_of: Sequence[int | None]) -> Self | None:
        """Back off after so many visits, 0 for never.

        A symbol that one state alone has adds nothing to that state; without any other there is nothing to
        back off to, and None is returned.

        Raises:
            ConfigurationError: A value is out of its range.
        """
        if visits == 0.0:
            return None
        states = Counter(symbol_of)
        found = cls(visits, tuple(None if states[symbol] == 1 else symbol for symbol in symbol_of))
        return None if all(symbol is None for symbol in found.symbol_of) else found

    def values(
        self, state: int, visits: Sequence[int], own: Sequence[float], symbol_q: Sequence[Sequence[float]]
    ) -> Sequence[float]:
        """Q of each action in a state, (actions,).

        Args:
            visits: How often each action was learned from there, (actions,).
            own: Its own Q, (actions,).
            symbol_q: Q of the symbols, (symbols, actions).
        """
        symbol, k = self.symbol_of[state], self.visits
        if symbol is None:
            return own
        return [
            (n * mine + k * theirs) / (n + k) for n, mine, theirs in zip(visits, own, symbol_q[symbol], strict=True)
        ]

    @property
    def symbols(self) -> int:
        """How many symbols have a Q; those that no state backs off to have one too, and never learn."""
        return 1 + max((symbol for symbol in self.symbol_of if symbol is not None), default=-1)


class BackingOff(QLearning):
    """Q-learning on states that back off to their symbols.

    With n visits of a state-action pair, and k of :class:`BackOff`, ``Q = (n Q_state + k Q_symbol) / (n + k)``; this Q
    chooses actions, and is the value of the next state. Both tables learn what every Q-learner does, each with the
    learning rate of its own visits; the first visit of a pair sets its ``Q_state``.

    Raises:
        ConfigurationError: A value is out of its range, names repeat, or there is not one symbol, or None, a state.
    """

    def __init__(
        self,
        states: Sequence[str],
        actions: Sequence[Action],
        parameters: QParameters,
        back_off: BackOff,
        *,
        frozen: bool = False,
    ) -> None:
        super().__init__(states, actions, parameters, frozen=frozen)
        if len(back_off.symbol_of) != len(self.states):
            accepted = f"{len(self.states)}, one a state"
            raise ConfigurationError("policy.back_off.symbol_of", len(back_off.symbol_of), accepted)
        self.back_off = back_off
        self._symbol_q = [[float(parameters.initial_value)] * len(self.actions) for _ in range(back_off.symbols)]
        self._symbol_visits = [[0] * len(self.actions) for _ in range(back_off.symbols)]

    @property
    def q(self) -> tuple[tuple[float, ...], ...]:
        """Q of each state and action, by which it acts."""
        return tuple(tuple(self._values(state)) for state in range(len(self.states)))

    def learn(self, transition: Transition) -> None:
        """Update the Q of one state and action, and that of its symbol, unless frozen."""
        symbol = self.back_off.symbol_of[transition.state]
        if self.frozen or symbol is None:
            super().learn(transition)
            return
        state, action = transition.state, transition.action_index
        target = transition.reinforcement + self.parameters.gamma * self._value_after(transition)
        visits = self._visits[state][action]
        own, shared = self._q[state], self._symbol_q[symbol]
        alpha = self.parameters.learning_rate(visits) if visits else 1.0
        own[action] = (1.0 - alpha) * own[action] + alpha * target
        alpha = self.parameters.learning_rate(self._symbol_visits[symbol][action])
        shared[action] = (1.0 - alpha) * shared[action] + alpha * target
        self._symbol_visits[symbol][action] += 1
        self._count(state, action)

    def _values(self, state: int) -> Sequence[float]:
        return self.back_off.values(state, self._visits[state], self._q[state], self._symbol_q)

    def get_state(self) -> dict[str, Any]:
        """As for every tabular learner, with the states' own Q as ``q``, and with what the symbols learned."""
        symbols = {"symbol_q": [list(row) for row in self._symbol_q]}
        return super().get_state() | symbols | {"symbol_visits": [list(row) for row in self._symbol_visits]}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go back to what :meth:`get_state` gave.

        Raises:
            ConfigurationError: It is the state of a learner of another size; nothing is changed then.
        """
        q = self._rows(state, "symbol_q", float, self.back_off.symbols)
        visits = self._rows(state, "symbol_visits", int, self.back_off.symbols)
        super().set_state(state)
        self._symbol_q, self._symbol_visits = q, visits
