"""Strings in, automaton out (paper, 3.4 and 5.3).

Networks are trained on the strings, automata made of the best of them by dynamic state partitioning, and the best
automaton is minimised. Labelled strings give an acceptor; positive ones, a Moore machine whose states give what may
come next. Beside the held-out loss of such a machine stand those of none of, and the last one, two and three symbols:
an automaton that is no better than these holds nothing that they do not. Where nothing
can be foretold, the last symbol itself is worse than none: what is counted behind each is counted less often.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar

from palpate.core.automata.choice import (
    Extract,
    ExtractionSettings,
    accepting_extract,
    cheapest,
    labelled,
    last_symbols,
    looseness,
    model_loss,
    predicting_extracts,
)
from palpate.core.automata.elman import MOST_HIDDEN, RANGES, Architecture, Readout
from palpate.core.automata.machine import Machine
from palpate.core.automata.strings import PrefixTree, Strings
from palpate.core.automata.training import OnProgress, TrainedNetwork, Training, TrainingSettings, train
from palpate.core.errors import ConfigurationError
from palpate.core.ports import OneOf, Range, Settings


@dataclass(frozen=True, slots=True, kw_only=True)
class InferenceSettings(Settings):
    """How to come from strings to an automaton."""

    TABLE: ClassVar[str] = "inference"

    hidden: Annotated[int, Range(1, MOST_HIDDEN)] = 2
    """Number of hidden units; the paper has 2."""
    activation: Annotated[str, OneOf(*RANGES)] = "sigmoid"
    """Activation function: sigmoid or tanh."""
    order: Annotated[int, OneOf(1, 2)] | None = None
    """1 for Elman networks, in which all symbols share the recurrent weights; 2 for second-order ones, in which each
    has its own. Without it: 2 for labelled strings, else 1."""
    training: TrainingSettings = field(default_factory=TrainingSettings)
    """How to train."""
    extraction: ExtractionSettings = field(default_factory=ExtractionSettings)
    """How to make automata."""
    finalists: Annotated[int, Range(1, 100_000)] = 16
    """How many of the best networks automata are made of; best on the training strings."""
    held_out: Annotated[float, Range(0.0, 0.9)] = 0.2
    """Share of the strings that is kept from training, if no others are given to hold out; 0 for none, which prediction
    cannot do with."""


@dataclass(frozen=True, slots=True, eq=False)
class Inference:
    """What was inferred, and from what.

    Attributes:
        chosen: The automaton with its q, its raw and minimal numbers of states and its loss. For prediction it is made
            of all strings that were not given to hold out, after those that were split off had chosen its q.
        extracts: Those of the same network that it was chosen from, by q; for acceptance itself alone.
        beside: For prediction, what the last none, one, two and three symbols lose on the held-out strings, by name.
    """

    chosen: Extract
    extracts: tuple[Extract, ...]
    network: TrainedNetwork
    training: Training
    strings: int
    held_out: int
    beside: dict[str, float]

    @property
    def machine(self) -> Machine:
        """The minimised automaton."""
        return self.chosen.machine

    @property
    def consistent(self) -> bool | None:
        """Whether the automaton is right about every training string; None for prediction."""
        return None if self.chosen.wrong is None else not self.chosen.wrong

    @property
    def summary(self) -> str:
        """A few lines for people."""
        chosen = self.chosen
        lines = [
            f"training: {self.training.summary}",
            f"automaton: q = {chosen.intervals}, {chosen.raw_states} cells, {chosen.states} states after minimisation",
        ]
        if chosen.wrong:
            lines.append(f"not consistent: wrong about {chosen.wrong:.1%} of {self.strings} training strings")
        if chosen.agreement is not None:
            lines.append(f"agreement: {chosen.agreement:.1%} of the held-out strings ({self.held_out} strings)")
        if chosen.loss is not None:
            beside = ", ".join(f"{name} {loss:.4f}" for name, loss in self.beside.items())
            lines.append(
                f"cross-entropy on {self.held_out} held-out strings: {chosen.loss:.4f} nats a symbol; {beside}"
            )
        return "\n".join(lines)


def infer(
    strings: Strings, settings: InferenceSettings | None = None, *, progress: OnProgress | None = None
) -> Inference:
    """Infer an automaton from strings.

    Returns:
        The best that was found, also if no automaton is right about every string (``consistent``).

    Raises:
        ConfigurationError: Settings that do not fit the strings.
    """
    settings = settings or InferenceSettings()
    whole, held_out = strings, None
    if settings.held_out:
        strings, held_out = strings.split(settings.held_out, settings.training.seed)
    reading = Readout.ACCEPTANCE if strings.labelled else Readout.PREDICTION
    shape = Architecture(
        alphabet=strings.alphabet,
        reading=reading,
        hidden=settings.hidden,
        activation=settings.activation,
        order=settings.order or (2 if strings.labelled else 1),
    )
    tree = PrefixTree.of(strings)
    held_tree = None if held_out is None else PrefixTree.of(held_out)
    if held_tree is None and reading is Readout.PREDICTION:
        raise ConfigurationError("inference.held_out", 0.0, "above 0: held-out strings choose q")
    training = train(strings, shape, settings.training, progress, held_tree)
    finalists = training.networks[: settings.finalists]
    beside: dict[str, float] = {}
    if held_tree is not None and reading is Readout.PREDICTION:
        network, extracts = _predictor(finalists, tree, held_tree, settings.extraction)
        machines = {f"last {count}": last_symbols(tree, count) for count in range(4)}
        beside = {name: model_loss(machine, tree, held_tree) for name, machine in machines.items()}
        tree = PrefixTree.of(whole)
        chosen = _whole(cheapest(extracts), tree, settings.extraction)
    else:
        network, extracts = _acceptor(finalists, tree, held_tree, settings.extraction)
        chosen = cheapest(extracts)
    return Inference(
        chosen=chosen,
        extracts=extracts,
        network=network,
        training=training,
        strings=len(strings.words),
        held_out=0 if held_out is None else len(held_out.words),
        beside=beside,
    )


def _acceptor(
    finalists: Sequence[TrainedNetwork], tree: PrefixTree, held_out: PrefixTree | None, settings: ExtractionSettings
) -> tuple[TrainedNetwork, tuple[Extract, ...]]:
    """The smallest of the automata that are right most often; of equally small ones the tightest."""
    found = [accepting_extract(trained.network, tree, settings, held_out) for trained in finalists]
    costs = [(extract.cost, extract.states, looseness(extract.machine, tree)) for extract in found]
    best = costs.index(min(costs))
    return finalists[best], (found[best],)


def _predictor(
    finalists: Sequence[TrainedNetwork], tree: PrefixTree, held_out: PrefixTree, settings: ExtractionSettings
) -> tuple[TrainedNetwork, tuple[Extract, ...]]:
    """The cheapest of all automata."""
    found = [(trained, predicting_extracts(trained.network, tree, settings, held_out)) for trained in finalists]
    return min(found, key=lambda pair: cheapest(pair[1]).cost)


def _whole(chosen: Extract, tree: PrefixTree, settings: ExtractionSettings) -> Extract:
    """The same of all strings, with its states labelled; itself, where all strings make too many states."""
    cells = settings.partition(chosen.partition.network, chosen.intervals, tree) or chosen.partition
    return replace(chosen, partition=cells, machine=labelled(cells.minimal(settings.least_share), tree))
