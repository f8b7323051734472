"""Which q? Partitions of one network with different numbers of intervals, judged by strings (paper, 5.3).

For acceptance: the smallest q whose automaton is right about every training string (Giles and others, 1992).

For prediction there is no right or wrong. The automaton is taken as a model of its own: in each state the next symbol,
or the end, has the probability with which it followed there in the training strings. Its cross-entropy on held-out
strings falls as q grows, ever more slowly, while each state must be filled with experience by whoever learns on it. So
a state has its price, one nat for each of its probabilities (Akaike, 1974), and the lowest sum is chosen. On two-unit
networks of two maps learners did best with such numbers of states; cross-entropy alone would take nearly the largest q,
and the price of Schwarz (1978), which grows with the number of strings, about half as many states.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar, Final

import numpy as np
from typing_extensions import override

from palpate.core.automata.elman import Array, Network
from palpate.core.automata.machine import Machine
from palpate.core.automata.partition import LEAST_SHARE, MOST_STATES, Partition, bounded_partition
from palpate.core.automata.prefix_tree import UNLABELLED, Integers, PrefixTree
from palpate.core.errors import ConfigurationError, require_whole
from palpate.core.ports import Range, Settings

_PSEUDO_COUNT: Final = 0.5
"""Added to each count, so that what never followed is not held to be impossible (Krichevsky and Trofimov, 1981)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExtractionSettings(Settings):
    """How to make automata of a network."""

    TABLE: ClassVar[str] = "extraction"

    fewest_intervals: Annotated[int, Range(1, 1000)] = 2
    """Lowest q that is tried."""
    most_intervals: Annotated[int, Range(1, 1000)] = 20
    """Highest q that is tried."""
    least_share: Annotated[float, Range(0.0, 0.999)] = LEAST_SHARE
    """Probability above which a symbol, or the end, is among the possible successors. Prediction only."""
    most_states: Annotated[int, Range(1, MOST_STATES)] = 500
    """A q that gives more states, before minimisation, is left out."""
    centres: bool = False
    """Let the middle of a cell stand for it, not the hidden state of the first visit."""
    merge_symbols: bool = False
    """Let minimisation merge states that different symbols lead into. Prediction only."""

    @override
    def check(self) -> None:
        require_whole("extraction.most_intervals", self.most_intervals, self.fewest_intervals, 1000)

    def partitions(self, network: Network) -> Iterator[Partition]:
        """Partitions of a network by rising q.

        Raises:
            ConfigurationError: At the end, if every q gives too many states.
        """
        fits = False
        for intervals in range(self.fewest_intervals, self.most_intervals + 1):
            found = bounded_partition(network, intervals, self.most_states, centres=self.centres)
            if found is not None:
                fits = True
                yield found
        if not fits:
            raise ConfigurationError(
                "extraction.most_states", self.most_states, "more, fewer hidden units, or a lower q"
            )

    def minimal(self, cells: Partition) -> Machine:
        """The minimised automaton of a partition."""
        return cells.minimal(self.least_share, merge_symbols=self.merge_symbols)


@dataclass(frozen=True, slots=True, eq=False)
class Extract:
    """An automaton made with one q, and how good it is.

    Attributes:
        wrong: Share of the training strings that it labels wrongly; None for prediction.
        agreement: On the held-out strings. For acceptance the share that is labelled rightly. For prediction the share
            of their prefixes, the empty one and the whole included, at which the automaton's set of possible successors
            is that of the network. None without held-out strings.
        loss: Cross-entropy on the held-out strings, nats a symbol; prediction only, else None.
        price: What the states are charged with, in the same unit; prediction only, else None.
    """

    partition: Partition
    machine: Machine
    wrong: float | None = None
    agreement: float | None = None
    loss: float | None = None
    price: float | None = None

    @property
    def intervals(self) -> int:
        """Number of intervals of each hidden unit, q."""
        return self.partition.intervals

    @property
    def raw_states(self) -> int:
        """Number of cells: states before those of different last symbols are separated, and before minimisation."""
        return len(self.partition.vectors)

    @property
    def states(self) -> int:
        """Number of states after minimisation."""
        return len(self.machine.transitions)

    @property
    def cost(self) -> float:
        """What is to be low: share of wrong training strings, or for prediction loss and price together."""
        return self.wrong if self.wrong is not None else (self.loss or 0.0) + (self.price or 0.0)


def accepting_extract(
    network: Network, training: PrefixTree, settings: ExtractionSettings, held_out: PrefixTree | None = None
) -> Extract:
    """The automaton of the smallest q that is right about every training string; if none is, of the best q.

    Raises:
        ConfigurationError: No labels, or another alphabet.
    """
    network.require_alphabet(training.alphabet)
    judged: list[tuple[float, Partition]] = []
    for cells in settings.partitions(network):
        judged.append((_wrong(cells, training), cells))
        if judged[-1][0] == 0.0:
            break
    wrong, cells = min(judged, key=lambda pair: pair[0])
    agreement = None if held_out is None else 1.0 - _wrong(cells, held_out)
    return Extract(cells, settings.minimal(cells), wrong=wrong, agreement=agreement)


def predicting_extracts(
    network: Network, training: PrefixTree, settings: ExtractionSettings, held_out: PrefixTree
) -> tuple[Extract, ...]:
    """Automata of all q in order, each with its agreement, loss and price; the one of the lowest cost is to be taken.

    Raises:
        ConfigurationError: The strings have another alphabet.
    """
    sets = network.read(network.hidden_states(held_out)) > settings.least_share
    weights = held_out.passes / held_out.passes.sum()
    found = []
    for cells in settings.partitions(network):
        machine = settings.minimal(cells)
        visited = held_out.states(cells.transitions)
        same = (network.read(cells.vectors) > settings.least_share)[visited] == sets
        loss, price = model_loss(machine, training, held_out), price_of(machine, training)
        agreement = float(weights[same.all(axis=1)].sum())
        found.append(Extract(cells, machine, agreement=agreement, loss=loss, price=price))
    return tuple(found)


def cheapest(extracts: Iterable[Extract]) -> Extract:
    """The one of the lowest cost; of equal ones the first."""
    return min(extracts, key=lambda extract: extract.cost)


def model_loss(machine: Machine, training: PrefixTree, held_out: PrefixTree) -> float:
    """Cross-entropy on held-out strings, nats a symbol, of a complete automaton with probabilities from training."""
    transitions = _complete(machine)
    counts = np.zeros((len(transitions), training.counts.shape[1]))
    np.add.at(counts, training.states(transitions, machine.start), training.counts)
    smoothed = counts + _PSEUDO_COUNT
    logs: Array = np.log(smoothed / smoothed.sum(axis=1, keepdims=True))
    drawn = held_out.counts
    return float(-(drawn * logs[held_out.states(transitions, machine.start)]).sum() / drawn.sum())


def price_of(machine: Machine, training: PrefixTree) -> float:
    """What the states of an automaton are charged with, in nats a symbol of the training strings."""
    return len(machine.transitions) * len(machine.alphabet) / int(training.counts.sum())


def _wrong(cells: Partition, tree: PrefixTree) -> float:
    """Share of labelled strings that the automaton of these cells labels wrongly."""
    nodes = np.flatnonzero(tree.labels != UNLABELLED)
    if not len(nodes):
        raise ConfigurationError("strings.labels", (), "labelled strings")
    labels = np.array(cells.machine().state_outputs)[tree.states(cells.transitions)[nodes]]
    ends = tree.counts[nodes, -1]
    return float(ends[labels != (tree.labels[nodes] == 1)].sum() / ends.sum())


def _complete(machine: Machine) -> Integers:
    if not machine.complete:
        raise ConfigurationError("automaton.transitions", "incomplete", "a transition for each state and symbol")
    return np.array(machine.transitions, dtype=np.int64)
