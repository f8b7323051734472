"""Extract automata from networks by dynamic state partitioning (paper, 5.3; Giles et al., 1992).

Each hidden unit's range is divided into q equal intervals, which define cells of hidden states. The search starts
at the start state and tries every symbol, breadth first. A hidden state in a new cell adds a state to the automaton. A
hidden state in a known cell only adds a transition. Each cell is represented by the first hidden state found in it.

If strings are given, the search follows only these, because a network also responds to inputs that it was not trained
on. Every state is then reached by at least one string.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from palpate.core.automata.elman import RANGES, Array, Network, Readout
from palpate.core.automata.machine import Kind, Machine
from palpate.core.automata.minimise import minimised
from palpate.core.automata.strings import END, Integers, PrefixTree

LEAST_SHARE: Final = 0.02
"""Probability above which a successor is possible."""

ACCEPTED_FROM: Final = 0.5
"""Probability above which a string is accepted."""

MOST_STATES: Final = 100_000
NONE: Final = -1
"""Placeholder for a missing state or symbol."""


@dataclass(frozen=True, slots=True, eq=False)
class Partition:
    """The partition for a given q, with n states in order of first visit; state 0 is the start.

    Attributes:
        network: The network, with s symbols and h hidden units.
        intervals: Number of intervals per hidden unit, q.
        vectors: Hidden state that represents each state, (n, h).
        transitions: Next state for each state and symbol, (n, s); -1 if no string leads there.
        cells: Cell number of each state, (n,).
        last: Last symbol in each state, (n,); -1 for the start, or for all states if symbols are not distinguished.
    """

    network: Network
    intervals: int
    vectors: Array
    transitions: Integers
    cells: Integers
    last: Integers

    def machine(self, least_share: float = LEAST_SHARE) -> Machine:
        """Return the automaton before minimisation.

        For prediction it is a Moore machine, whose outputs are sets of possible successors: symbols and the end. For
        acceptance it is an acceptor.

        Args:
            least_share: Probability above which a successor is possible; not used for acceptance.
        """
        shape = self.network.architecture
        shares = self.network.read(self.vectors)
        rows = tuple(tuple(None if to == NONE else to for to in row) for row in self.transitions.tolist())
        if shape.reading is Readout.ACCEPTANCE:
            return Machine(Kind.DFA, shape.alphabet, rows, tuple((shares[:, 0] > ACCEPTED_FROM).tolist()))
        names = (*shape.alphabet, END)
        outputs = tuple(
            tuple(name for name, possible in zip(names, row, strict=True) if possible)
            for row in (shares > least_share).tolist()
        )
        return Machine(Kind.MOORE, shape.alphabet, rows, outputs)

    def minimal(self, least_share: float = LEAST_SHARE) -> Machine:
        """Return the minimised automaton.

        If last symbols are distinguished, states with different last symbols are not merged. Nor are states whose cells
        are entered by different sets of symbols, because possible successors alone do not separate states well enough.
        """
        leading_in: dict[int, list[int]] = {}
        for cell, symbol in zip(self.cells.tolist(), self.last.tolist(), strict=True):
            leading_in.setdefault(cell, []).append(symbol)
        apart = [
            (tuple(sorted(leading_in[cell])), symbol)
            for cell, symbol in zip(self.cells.tolist(), self.last.tolist(), strict=True)
        ]
        return minimised(self.machine(least_share), apart if (self.last != NONE).any() else None)


def bounded_partition(
    network: Network,
    intervals: int,
    most_states: int = MOST_STATES,
    *,
    by_symbol: bool = False,
    tree: PrefixTree | None = None,
) -> Partition | None:
    """Find the states and transitions of the automaton for a given q.

    Args:
        intervals: Number of intervals per hidden unit, q, at least 1.
        most_states: Maximum number of states; the function returns None if there are more.
        by_symbol: True creates a separate state in a cell for each symbol that leads into it. A policy without an
            automaton already distinguishes the last symbol.
        tree: The strings; None for all possible strings.
    """
    search = _Search(network, intervals, by_symbol)
    if tree is None:
        known = 0
        while known < len(search.vectors) <= most_states:
            # A whole level is searched at once; the order of first visits is the same as in a node-by-node search.
            fresh, known = np.arange(known, len(search.vectors)), len(search.vectors)
            search.go(np.repeat(fresh, search.symbols), np.tile(np.arange(search.symbols), len(fresh)))
    else:
        at = np.zeros(len(tree.parents), dtype=np.int64)
        for first, last in pairwise(tree.levels[1:].tolist()):
            at[first:last] = search.go(at[tree.parents[first:last]], tree.symbols[first:last])
            if len(search.vectors) > most_states:
                break
    return search.partition() if len(search.vectors) <= most_states else None


class _Search:
    """Search for a partition's states."""

    def __init__(self, network: Network, intervals: int, by_symbol: bool) -> None:
        self._network, self._intervals = network, intervals
        self._low, high = RANGES[network.architecture.activation]
        self._width = (high - self._low) / intervals
        self._by_symbol, self.symbols = by_symbol, len(network.architecture.alphabet)
        self._cell_of: dict[bytes, int] = {}
        self._state_of: dict[tuple[int, int], int] = {}
        self._target_of: dict[int, int] = {}
        self.vectors: list[Array] = []
        self._enter(network.start_state, self._cells(network.start_state), NONE)

    def go(self, states: Integers, symbols: Integers) -> Integers:
        """Return the next state for each state-symbol pair; all arrays are (m,)."""
        codes = states * self.symbols + symbols
        listed = codes.tolist()
        fresh = list(dict.fromkeys(code for code in listed if code not in self._target_of))
        if fresh:
            sources, taken = np.divmod(np.array(fresh), self.symbols)
            hidden = self._network.after(np.array([self.vectors[source] for source in sources]), taken)
            last = taken.tolist() if self._by_symbol else [NONE] * len(fresh)
            for code, *found in zip(fresh, hidden, self._cells(hidden), last, strict=True):
                self._target_of[code] = self._enter(*found)
        return np.array([self._target_of[code] for code in listed], dtype=np.int64)

    def partition(self) -> Partition:
        """Return the partition found."""
        transitions = np.full(len(self.vectors) * self.symbols, NONE)
        transitions[list(self._target_of)] = list(self._target_of.values())
        cells, last = np.array(list(self._state_of)).T
        shaped = transitions.reshape(-1, self.symbols)
        return Partition(self._network, self._intervals, np.array(self.vectors), shaped, cells, last)

    def _cells(self, hidden: Array) -> Integers:
        return np.clip((hidden - self._low) // self._width, 0, self._intervals - 1).astype(np.int16)

    def _enter(self, vector: Array, cell: Integers, symbol: int) -> int:
        number = self._cell_of.setdefault(cell.tobytes(), len(self._cell_of))
        if (number, symbol) not in self._state_of:
            self._state_of[number, symbol] = len(self.vectors)
            self.vectors.append(vector)
        return self._state_of[number, symbol]
