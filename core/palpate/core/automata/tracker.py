"""State identifier that uses an automaton to track a trial's symbols (paper, 3.4 and 5.3)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final, TypeAlias

import numpy as np
from typing_extensions import override

from palpate.core.automata.machine import Machine
from palpate.core.automata.strings import Integers, PrefixTree, Strings
from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.ports import Names, Settings, fitted, register_stage

LOST: Final = "lost"
"""State name for unknown transitions."""

_FIELD: Final = "perception.identifier"
_NONE: Final = -1

Known: TypeAlias = tuple[int | None, ...]


@dataclass
class AutomatonState(Settings):
    """State identifier that runs an automaton on the symbols, with an additional state for unknown transitions.

    A symbol for which the current state has no transition leads to the state ``lost``, which has the highest number.
    Each symbol has an anchor: the state to which it usually leads. At the next symbol, the automaton continues from the
    anchor of the previous symbol if that state has a transition; otherwise it remains lost.

    The fields are plain values that can be stored in files; :meth:`of` derives them from a machine.

    Attributes:
        automaton: Names of the automaton's states.
        transitions: Next state for each state and symbol, (states, symbols); None if unknown.
        anchors: Anchor for each symbol, (symbols,); None for a symbol without one.

    Raises:
        ConfigurationError: The sizes are inconsistent, or a state is named ``lost``.
    """

    TABLE: ClassVar[str] = _FIELD

    symbols: Names
    automaton: Names
    transitions: tuple[Known, ...]
    anchors: Known
    start: int = 0

    @override
    def check(self) -> None:
        self.require("automaton", LOST not in self.automaton, f"names other than {LOST}, which is the unknown state")
        states, symbols = len(self.automaton), len(self.symbols)
        known = {None, *range(states)}
        rows = all(len(row) == symbols and known.issuperset(row) for row in self.transitions)
        fits = rows and len(self.transitions) == states
        self.require("transitions", fits, f"{states} rows of {symbols} states from 0 to {states - 1}, or none")
        fits = len(self.anchors) == symbols and known.issuperset(self.anchors)
        self.require("anchors", fits, f"{symbols} states from 0 to {states - 1}, or none")
        self.require("start", self.start in known, f"a state from 0 to {states - 1}")
        self.reset()

    @classmethod
    def of(
        cls,
        machine: Machine,
        strings: Strings | PrefixTree | None = None,
        *,
        symbols: Iterable[str] | None = None,
    ) -> AutomatonState:
        """Create an identifier that runs a machine.

        Args:
            machine: Any machine; only its transitions are used.
            strings: Strings from which it was inferred. Transitions that no string takes are then unknown because a
                network has a transition even for input that it was not trained on. A symbol's anchor is the state
                to which it leads most often in the strings, or, without strings, in most transitions.
            symbols: Symbol names in the order used in the trials; None uses the machine's order.

        Raises:
            ConfigurationError: The symbols are not the machine's, or the strings have a different alphabet.
        """
        given = machine.alphabet if symbols is None else tuple(symbols)
        if sorted(given) != sorted(machine.alphabet):
            # A symbol that the machine lacks would always lead to ``lost``.
            accepted = f"all symbols of the machine and no others: {', '.join(machine.alphabet)}"
            raise ConfigurationError(f"{_FIELD}.symbols", given, accepted)
        taken = _taken(machine, PrefixTree.of(strings) if isinstance(strings, Strings) else strings)
        order = [machine.alphabet.index(name) for name in given]
        rows = tuple(
            tuple(row[symbol] if taken[state, symbol] else None for symbol in order)
            for state, row in enumerate(machine.transitions)
        )
        entered = _entered(machine, taken)
        anchors = tuple(int(counts.argmax()) if counts.any() else None for counts in entered[order])
        return AutomatonState(given, machine.names, rows, anchors, machine.start)

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the automaton's states, followed by ``lost``."""
        return (*self.automaton, LOST)

    @property
    def symbol_of(self) -> tuple[int | None, ...]:
        """Symbol that leads to each state, (states,); if there are several, the one that does so from the most states.

        The symbol is None for ``lost`` and for states without a known incoming transition.
        """
        entered = [[0] * len(self.symbols) for _ in self.states]
        for row in self.transitions:
            for symbol, target in enumerate(row):
                if target is not None:
                    entered[target][symbol] += 1
        return tuple(counts.index(max(counts)) if any(counts) else None for counts in entered)

    @property
    def lost(self) -> int:
        """Number of the state ``lost``."""
        return len(self.automaton)

    def reset(self) -> None:
        """Return to the start state at the beginning of a trial."""
        self._now, self._last = self.start, _NONE

    def update(self, symbol: int, action: str | None = None) -> int:
        """Return the state after one more symbol; the action is ignored.

        Raises:
            CommandError: The symbol does not exist.
        """
        if not 0 <= symbol < len(self.symbols):
            raise CommandError(f"a symbol must be from 0 to {len(self.symbols) - 1}", symbol)
        source = self.anchors[self._last] if self._now == self.lost else self._now
        target = None if source is None else self.transitions[source][symbol]
        self._last = symbol
        self._now = self.lost if target is None else target
        return self._now

    def table(self) -> Integers:
        """Return the next state for each state and symbol, with a separate lost state for each symbol that leads there.

        Returns:
            (states + symbols, symbols); numbers from :attr:`lost` on are lost states.
        """
        known = np.array([[_NONE if to is None else to for to in row] for row in self.transitions])
        anchors = np.array([_NONE if to is None else to for to in self.anchors])
        lost = self.lost + np.arange(len(self.symbols))
        after = np.where(known >= 0, known, lost)
        return np.concatenate((after, np.where(anchors[:, None] >= 0, after[anchors], lost)))

    def get_state(self) -> list[float]:
        """Return the state and the last symbol (-1 for none), for :meth:`set_state`."""
        return [float(self._now), float(self._last)]

    def set_state(self, state: Sequence[float]) -> None:
        """Resume from a state returned by :meth:`get_state`.

        Raises:
            ConfigurationError: The state does not belong to this identifier.
        """
        accepted = "a state and a last symbol, from get_state"
        values: tuple[float, float] = fitted(f"{_FIELD}.state", state, tuple[float, float])
        if not all(value.is_integer() for value in values):
            raise ConfigurationError(f"{_FIELD}.state", state, accepted)
        now, last = map(int, values)
        known = 0 <= now <= self.lost and _NONE <= last < len(self.symbols)
        if not known or (now == self.lost and last == _NONE):
            raise ConfigurationError(f"{_FIELD}.state", state, accepted)
        self._now, self._last = now, last


def _taken(machine: Machine, tree: PrefixTree | None) -> Integers:
    """Count how often the strings take each transition, (states, symbols); without strings, return 1 for each."""
    off = len(machine.transitions)
    known = np.array([[off if target is None else target for target in row] for row in machine.transitions])
    if tree is None:
        return np.where(known < off, 1, 0)
    if tree.alphabet != machine.alphabet:
        raise ConfigurationError("strings.alphabet", tree.alphabet, f"that of the machine, {machine.alphabet}")
    at = tree.states(np.concatenate((known, np.full((1, known.shape[1]), off))), machine.start)
    counts = np.zeros((off + 1, known.shape[1]), dtype=np.int64)
    np.add.at(counts, (at[tree.parents[1:]], tree.symbols[1:]), tree.passes[1:])
    return np.where(known < off, counts[:off], 0)


def _entered(machine: Machine, taken: Integers) -> Integers:
    """Count how often each symbol leads to each state, (symbols, states)."""
    entered = np.zeros(taken.T.shape, dtype=np.int64)
    for row, counts in zip(machine.transitions, taken, strict=True):
        for symbol, target in enumerate(row):
            if target is not None:
                entered[symbol, target] += counts[symbol]
    return entered


register_stage("automaton", AutomatonState)
