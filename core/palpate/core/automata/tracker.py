"""The learner's state is the state of an automaton that follows the symbols of the trial (paper, 3.4 and 5.3)."""

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
"""Name of the state of not knowing."""

_FIELD: Final = "perception.identifier"
_NONE: Final = -1

Known: TypeAlias = tuple[int | None, ...]


@dataclass
class AutomatonState(Settings):
    """Follows an automaton; where no transition is known, it enters a state of its own for that.

    A symbol for which the current state has no transition leads to the state ``lost``, whose number is the highest. At
    the next symbol it is taken for granted that the automaton was where the symbol before usually leads, its anchor,
    and the automaton goes on from there, if it can; otherwise it is still lost.

    The fields are plain values for files; :meth:`of` makes them of a machine.

    Attributes:
        automaton: Names of the automaton's states.
        transitions: Next state by state and symbol, (states, symbols); None where none is known.
        anchors: For each symbol the state in which the automaton is assumed to have been after it, (symbols,); None
            where nothing is assumed.

    Raises:
        ConfigurationError: The parts do not fit together, or a state is called ``lost``.
    """

    TABLE: ClassVar[str] = _FIELD

    symbols: Names
    automaton: Names
    transitions: tuple[Known, ...]
    anchors: Known
    start: int = 0

    @override
    def check(self) -> None:
        self.require("automaton", LOST not in self.automaton, f"other names than {LOST}: it means that none is known")
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
        """Follow a machine.

        Args:
            machine: Any machine; only its transitions matter.
            strings: Strings that it was inferred from. If they are given, a transition that none of them took is not
                known: a network gives a transition for everything, also for what it was never trained on. They
                also give the state a symbol leads to most often; without them the number of transitions does.
            symbols: Names of the symbols that come, if their order is not that of the machine.

        Raises:
            ConfigurationError: The symbols are not those of the machine, or the strings are of another alphabet.
        """
        given = machine.alphabet if symbols is None else tuple(symbols)
        if sorted(given) != sorted(machine.alphabet):
            # One that the machine lacks would lead to ``lost`` wherever it comes.
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
        """Names of the automaton's states, and ``lost``."""
        return (*self.automaton, LOST)

    @property
    def symbol_of(self) -> tuple[int | None, ...]:
        """For each state the symbol that leads into it, of several the one that does so from most states, (states,).

        None for states that no known transition leads into, and for ``lost``.
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
        """A trial begins: back to the start state."""
        self._now, self._last = self.start, _NONE

    def update(self, symbol: int, action: str | None = None) -> int:
        """State after one more symbol; the action that led to it does not count.

        Raises:
            CommandError: No such symbol.
        """
        if not 0 <= symbol < len(self.symbols):
            raise CommandError(f"a symbol must be from 0 to {len(self.symbols) - 1}", symbol)
        source = self.anchors[self._last] if self._now == self.lost else self._now
        target = None if source is None else self.transitions[source][symbol]
        self._last = symbol
        self._now = self.lost if target is None else target
        return self._now

    def table(self) -> Integers:
        """Next state by state and symbol, where being lost is a state for each symbol that led there.

        Returns:
            (states + symbols, symbols); those from :attr:`lost` on are being lost.
        """
        known = np.array([[_NONE if to is None else to for to in row] for row in self.transitions])
        anchors = np.array([_NONE if to is None else to for to in self.anchors])
        lost = self.lost + np.arange(len(self.symbols))
        after = np.where(known >= 0, known, lost)
        return np.concatenate((after, np.where(anchors[:, None] >= 0, after[anchors], lost)))

    def get_state(self) -> list[float]:
        """State and last symbol (-1 for none), for :meth:`set_state`."""
        return [float(self._now), float(self._last)]

    def set_state(self, state: Sequence[float]) -> None:
        """Go on from where :meth:`get_state` was called.

        Raises:
            ConfigurationError: Not a memory of this identifier.
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
    """How often each transition is taken, (states, symbols): by the strings, or else once where there is one."""
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
    """How often each symbol leads to each state, (symbols, states)."""
    entered = np.zeros(taken.T.shape, dtype=np.int64)
    for row, counts in zip(machine.transitions, taken, strict=True):
        for symbol, target in enumerate(row):
            if target is not None:
                entered[symbol, target] += counts[symbol]
    return entered


register_stage("automaton", AutomatonState)
