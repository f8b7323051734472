"""Automata from networks by dynamic state partitioning (paper, 5.3; Giles and others, 1992).

The range of each hidden unit is cut into q equal intervals. From the start state on, breadth first, every symbol is
tried; a hidden state in a cell that nobody was in makes a new state of the automaton, one in a known cell makes a
transition only, and is not pursued. So the hidden state of the first visit stands for its cell. With ``centres`` the
middle of the cell does (Blair and Pollack, 1997), which tests whether the network behaves as an automaton at all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from palpate.core.automata.elman import END, RANGES, Array, Network, Readout
from palpate.core.automata.machine import Kind, Machine
from palpate.core.automata.minimise import minimised
from palpate.core.automata.prefix_tree import Integers
from palpate.core.errors import ConfigurationError, require_in, require_whole

LEAST_SHARE: Final = 0.02
"""Probability above which a successor is held to be possible."""

ACCEPTED_FROM: Final = 0.5
"""Probability above which a string is held to be accepted."""

MOST_INTERVALS: Final = 1000
MOST_STATES: Final = 100_000


@dataclass(frozen=True, slots=True, eq=False)
class Partition:
    """What was found with one q: n cells in the order of their first visits, the start state's being number 0.

    Attributes:
        network: The network, with s symbols and h hidden units.
        intervals: Number of intervals of each hidden unit, q.
        vectors: Hidden state that stands for each cell, (n, h).
        transitions: Cell after each cell and symbol, (n, s).
    """

    network: Network
    intervals: int
    vectors: Array
    transitions: Integers

    def machine(self, least_share: float = LEAST_SHARE) -> Machine:
        """The automaton, one state a cell, not minimised.

        Args:
            least_share: For prediction: the output of a state is the set of those symbols, and of the end, that follow
                with a higher probability than this, and it is a Moore machine. For acceptance it does not matter: the
                output is whether the string is accepted, and it is an acceptor.

        Raises:
            ConfigurationError: ``least_share`` is not a probability below 1.
        """
        require_in("automaton.least_share", least_share, 0.0, 0.999)
        shape = self.network.architecture
        shares = self.network.read(self.vectors)
        rows = tuple(map(tuple, self.transitions.tolist()))
        if shape.reading is Readout.ACCEPTANCE:
            return Machine(Kind.DFA, shape.alphabet, rows, tuple((shares[:, 0] > ACCEPTED_FROM).tolist()))
        names = (*shape.alphabet, END)
        outputs = tuple(
            tuple(name for name, possible in zip(names, row, strict=True) if possible)
            for row in (shares > least_share).tolist()
        )
        return Machine(Kind.MOORE, shape.alphabet, rows, outputs)

    def minimal(self, least_share: float = LEAST_SHARE, *, merge_symbols: bool = False) -> Machine:
        """The automaton, minimised.

        Args:
            least_share: As for :meth:`machine`.
            merge_symbols: Whether different symbols may lead into one state of a prediction automaton. By default they
                do not: a cell that several lead into makes as many states, and states of different last symbols are not
                merged. The last symbol is all that a policy has without any automaton.

        Raises:
            ConfigurationError: ``least_share`` is not a probability below 1.
        """
        machine = self.machine(least_share)
        if merge_symbols or machine.kind is Kind.DFA:
            return minimised(machine)
        return minimised(*self._by_last_symbol(machine))

    def _by_last_symbol(self, machine: Machine) -> tuple[Machine, list[tuple[bytes, int]]]:
        """The automaton with a state for each cell and symbol that leads into it, and what keeps its states apart.

        That is the symbol, and the set of all that lead into the cell: the possible successors alone distinguish too
        little.
        State 0 is the start cell before the first symbol, which is numbered -1.
        """
        targets, symbols = self.transitions, range(self.transitions.shape[1])
        enters = np.zeros(targets.shape, dtype=bool)
        enters[targets, symbols] = True
        pairs = np.argwhere(enters)
        state_of = np.zeros_like(targets)
        state_of[enters] = np.arange(1, len(pairs) + 1)
        cells, last = [0, *pairs[:, 0].tolist()], [-1, *pairs[:, 1].tolist()]
        rows = tuple(map(tuple, state_of[targets, symbols][cells].tolist()))
        outputs = tuple(machine.state_outputs[cell] for cell in cells)
        apart = [(enters[cell].tobytes(), symbol) for cell, symbol in zip(cells, last, strict=True)]
        return Machine(machine.kind, machine.alphabet, rows, outputs), apart


def partition(network: Network, intervals: int, *, centres: bool = False) -> Partition:
    """Find the cells that strings lead to, and how.

    Args:
        network: The network.
        intervals: Number of intervals of each hidden unit, q, 1 or more.
        centres: Let the middle of each cell stand for it, not the hidden state of the first visit.

    Raises:
        ConfigurationError: The number of intervals is out of range, or there are more than ``MOST_STATES`` cells.
    """
    found = bounded_partition(network, intervals, MOST_STATES, centres=centres)
    if found is None:
        accepted = f"fewer; this gives more than {MOST_STATES} states"
        raise ConfigurationError("automaton.intervals", intervals, accepted)
    return found


def bounded_partition(network: Network, intervals: int, most_states: int, *, centres: bool = False) -> Partition | None:
    """The same, but None if there are more cells than ``most_states``; q^h may be many."""
    require_whole("automaton.intervals", intervals, 1, MOST_INTERVALS)
    low, high = RANGES[network.architecture.activation]
    width = (high - low) / intervals
    states: dict[bytes, int] = {}
    vectors: list[Array] = []
    transitions: list[Integers] = []
    candidates = network.start_state[np.newaxis]
    while len(candidates):
        # A level of the search at once; the order of first visits is that of one after the other.
        cells = np.clip((candidates - low) // width, 0, intervals - 1)
        keys = [row.tobytes() for row in cells.astype(np.int16)]
        fresh = []
        for place, key in enumerate(keys):
            if key not in states:
                states[key] = len(states)
                fresh.append(place)
        if len(states) > most_states:
            return None
        if vectors:
            numbers = np.array([states[key] for key in keys], dtype=np.int64)
            transitions.append(numbers.reshape(-1, len(network.architecture.alphabet)))
        found = low + (cells[fresh] + 0.5) * width if centres else candidates[fresh]
        vectors.append(found)
        candidates = network.successors(found).reshape(-1, candidates.shape[1])
    return Partition(network, intervals, np.concatenate(vectors), np.concatenate(transitions))
