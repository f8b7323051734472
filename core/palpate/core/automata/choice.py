"""Select q, the number of intervals, by scoring a network's partitions on strings (paper, 5.3).

For acceptance, the smallest q whose automaton classifies every training string correctly is chosen (Giles et al.,
1992).

For prediction, the automaton is scored as a probabilistic model. In each state, the probability of the next symbol, or
of the end, is its relative frequency in the training strings. The cross-entropy on held-out strings falls ever more
slowly as q grows, but a learner needs experience in every state. Each state therefore adds a penalty of one nat per
probability (Akaike, 1974), and the q with the lowest total is chosen. In tests with two-unit networks on two maps,
learners performed best with the selected numbers of states. Cross-entropy alone would choose nearly the largest q. The
penalty of Schwarz (1978), which grows with the number of strings, would choose about half as many states.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from math import log
from typing import Annotated, ClassVar, Final

import numpy as np
from typing_extensions import override

from palpate.core.automata.elman import Array, Network, Readout
from palpate.core.automata.machine import Kind, Machine
from palpate.core.automata.minimise import different
from palpate.core.automata.partition import LEAST_SHARE, MOST_STATES, Partition, bounded_partition
from palpate.core.automata.strings import END, UNLABELLED, PrefixTree
from palpate.core.automata.tracker import AutomatonState
from palpate.core.errors import ConfigurationError, require_whole
from palpate.core.ports import Range, Settings

_MOST_LEFT_OUT: Final = 3
_LEAST: Final = 1e-300


@dataclass(frozen=True, slots=True, kw_only=True)
class ExtractionSettings(Settings):
    """Settings for extracting automata from a network."""

    TABLE: ClassVar[str] = "extraction"

    fewest_intervals: Annotated[int, Range(1, 1000)] = 2
    """Lowest q to try."""
    most_intervals: Annotated[int, Range(1, 1000)] = 20
    """Highest q to try."""
    least_share: Annotated[float, Range(0.0, 0.999)] = LEAST_SHARE
    """Probability above which a symbol, or the end, counts as a possible successor. For prediction only."""
    most_states: Annotated[int, Range(1, MOST_STATES)] = 500
    """Maximum number of states before minimisation; a q that yields more is skipped."""
    merge_symbols: bool = False
    """Allow different symbols to lead to the same state. For prediction only."""

    @override
    def check(self) -> None:
        require_whole("extraction.most_intervals", self.most_intervals, self.fewest_intervals, 1000)

    def partitions(self, network: Network, tree: PrefixTree | None = None) -> Iterator[Partition]:
        """Yield a network's partitions in ascending order of q, stopping after three with too many states.

        If a tree is given, the search follows only its strings.
        """
        fits, left_out = False, 0
        for intervals in range(self.fewest_intervals, self.most_intervals + 1):
            found = self.partition(network, intervals, tree)
            if found is not None:
                fits = True
                yield found
                continue
            left_out += 1
            if left_out == _MOST_LEFT_OUT:
                break
        if not fits:
            raise ConfigurationError(
                "extraction.most_states", self.most_states, "larger, or use fewer hidden units or a lower q"
            )

    def partition(self, network: Network, intervals: int, tree: PrefixTree | None = None) -> Partition | None:
        """Return the partition for a given q, or None if it has too many states."""
        apart = network.architecture.reading is Readout.PREDICTION and not self.merge_symbols
        return bounded_partition(network, intervals, self.most_states, by_symbol=apart, tree=tree)


@dataclass(frozen=True, slots=True, eq=False)
class Extract:
    """An automaton extracted with a given q, and its scores.

    Attributes:
        wrong: Fraction of the training strings that it mislabels; None for prediction.
        agreement: Fraction of the held-out strings that it labels correctly; None if there are none.
        loss: Cross-entropy on the held-out strings, in nats per symbol; None for acceptance.
        price: Penalty for the number of states, in nats per symbol; None for acceptance.
    """

    partition: Partition
    machine: Machine
    wrong: float | None = None
    agreement: float | None = None
    loss: float | None = None
    price: float | None = None

    @property
    def intervals(self) -> int:
        """Number of intervals per hidden unit, q."""
        return self.partition.intervals

    @property
    def raw_states(self) -> int:
        """Number of states before minimisation."""
        return len(self.partition.vectors)

    @property
    def states(self) -> int:
        """Number of states after minimisation."""
        return len(self.machine.transitions)

    @property
    def cost(self) -> float:
        """Cost to minimise: fraction of mislabelled training strings, or, for prediction, the sum of loss and price."""
        return self.wrong if self.wrong is not None else (self.loss or 0.0) + (self.price or 0.0)


def accepting_extract(
    network: Network, training: PrefixTree, settings: ExtractionSettings, held_out: PrefixTree | None = None
) -> Extract:
    """Return the automaton with the smallest q that labels all training strings correctly, or else the best one."""
    judged: list[tuple[float, Partition]] = []
    for cells in settings.partitions(network):
        judged.append((_wrong(cells, training), cells))
        if judged[-1][0] == 0.0:
            break
    wrong, cells = min(judged, key=lambda pair: pair[0])
    agreement = None if held_out is None else 1.0 - _wrong(cells, held_out)
    return Extract(cells, cells.minimal(settings.least_share), wrong=wrong, agreement=agreement)


def size_principle_cost(machine: Machine, tree: PrefixTree) -> float:
    """Return the size-principle cost for labelled strings, in nats, up to an additive constant.

    Words of the same length and label are assumed to be equally likely. Of two acceptors that label all strings
    correctly, the one that accepts fewer words costs less (the size principle of Tenenbaum and Griffiths, 2001).
    """
    targets, accepting = np.array(machine.transitions), np.array(machine.state_outputs, dtype=bool)
    lengths = np.repeat(np.arange(len(tree.levels) - 1), np.diff(tree.levels))
    came = np.zeros((len(tree.levels) - 1, 2))
    strings = tree.labels != UNLABELLED
    np.add.at(came, (lengths[strings], tree.labels[strings]), tree.counts[strings, -1])
    # Fraction of all words of a given length that lead to each state.
    shares = np.where(np.arange(len(targets)) == machine.start, 1.0, 0.0)
    cost = 0.0
    for rejected, accepted in came.tolist():
        inside = float(shares[accepting].sum())
        cost += rejected * log(max(1.0 - inside, _LEAST)) + accepted * log(max(inside, _LEAST))
        before, shares = shares / targets.shape[1], np.zeros(len(targets))
        np.add.at(shares, targets, before[:, None])
    return cost


def predicting_extracts(
    network: Network, training: PrefixTree, settings: ExtractionSettings, held_out: PrefixTree
) -> tuple[Extract, ...]:
    """Return the automata for all values of q, in ascending order, each with its loss and price."""
    found = []
    for cells in settings.partitions(network, training):
        machine = cells.minimal(settings.least_share)
        loss, price = model_loss(machine, training, held_out), price_of(machine, training)
        found.append(Extract(cells, machine, loss=loss, price=price))
    return tuple(found)


def cheapest(extracts: Iterable[Extract]) -> Extract:
    """Return the automaton with the lowest cost; if several tie, the first one."""
    return min(extracts, key=lambda extract: extract.cost)


def model_loss(machine: Machine, training: PrefixTree, held_out: PrefixTree) -> float:
    """Return an automaton's cross-entropy on held-out strings, in nats per symbol.

    The probabilities come from the training strings. An :class:`AutomatonState` processes the strings as in a trial.
    Half a count is added for each outcome, so that unseen outcomes stay possible (Krichevsky and Trofimov, 1981). These
    counts are uniform for a symbol; for a state, they are proportional to the outcomes that follow its last symbol.
    """
    follower = AutomatonState.of(machine, training)
    counts, drawn = _followed(follower, training, machine.start), _followed(follower, held_out, machine.start)
    width = len(machine.alphabet) + 1
    last = np.array([width - 1 if symbol is None else symbol for symbol in follower.symbol_of])
    pooled = np.zeros((width, width))
    np.add.at(pooled, last, counts)
    pooled = (pooled + 0.5) / (pooled + 0.5).sum(axis=1, keepdims=True)
    smoothed = counts + 0.5 * width * pooled[last]
    return float(-(drawn * np.log(smoothed / smoothed.sum(axis=1, keepdims=True))).sum() / drawn.sum())


def _followed(follower: AutomatonState, tree: PrefixTree, start: int) -> Array:
    """Return how often each symbol, or the end, follows each state, (states, symbols + 1)."""
    counts = np.zeros((follower.lost + 1, tree.counts.shape[1]))
    np.add.at(counts, np.minimum(tree.states(follower.table(), start), follower.lost), tree.counts)
    return counts


def price_of(machine: Machine, training: PrefixTree) -> float:
    """Return the penalty for the number of states, in nats per training symbol."""
    return len(machine.transitions) * len(machine.alphabet) / int(training.counts.sum())


def last_symbols(tree: PrefixTree, count: int) -> Machine:
    """Return the automaton whose states are the last ``count`` symbols of the strings.

    States at the beginning of a string contain fewer symbols. If ``count`` is 0, the automaton has one state.
    """
    words: list[tuple[int, ...]] = [()]
    number: dict[tuple[int, ...], int] = {(): 0}
    rows: list[list[int | None]] = [[None] * len(tree.alphabet)]
    for parent, symbol in zip(tree.parents[1:].tolist(), tree.symbols[1:].tolist(), strict=True):
        word = (*words[parent], symbol)[-count:] if count else ()
        words.append(word)
        if word not in number:
            number[word] = len(number)
            rows.append([None] * len(tree.alphabet))
        rows[number[words[parent]]][symbol] = number[word]
    return Machine(Kind.MOORE, tree.alphabet, tuple(map(tuple, rows)), ("",) * len(rows))


def labelled(machine: Machine, tree: PrefixTree) -> Machine:
    """Label each machine state with its last symbol and likely successors, such as ``C > A D``.

    A likely successor follows in at least a tenth of all cases. At most three are listed, the most likely one first.
    """
    follower, names = AutomatonState.of(machine, tree), (*machine.alphabet, END)
    counts = _followed(follower, tree, machine.start)
    labels = []
    for last, after in zip(follower.symbol_of[: follower.lost], counts.tolist(), strict=False):
        likely = [name for name, count in zip(names, after, strict=True) if 10 * count >= max(1, sum(after))]
        likely.sort(key=lambda name: -after[names.index(name)])
        labels.append(f"{'start' if last is None else names[last]} > {' '.join(likely[:3])}")
    return replace(machine, labels=different(labels))


def _wrong(cells: Partition, tree: PrefixTree) -> float:
    """Return the fraction of the labelled strings that the automaton mislabels, given its cells."""
    nodes = np.flatnonzero(tree.labels != UNLABELLED)
    if not len(nodes):
        raise ConfigurationError("strings.labels", (), "labelled strings")
    labels = np.array(cells.machine().state_outputs)[tree.states(cells.transitions)[nodes]]
    ends = tree.counts[nodes, -1]
    return float(ends[labels != (tree.labels[nodes] == 1)].sum() / ends.sum())
