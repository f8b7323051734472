"""Infer an automaton from strings (paper, 3.4 and 5.3).

Networks are trained on the strings. Automata are extracted from the best networks by dynamic state partitioning, and
the best automaton is minimised. Labelled strings yield an acceptor, positive strings a Moore machine whose outputs are
the possible next symbols. The held-out loss of such a machine is reported along with four baselines: machines whose
states are the last zero, one, two and three symbols. An automaton that is no better than these baselines is useless. If
the next symbol is unpredictable, even the last symbol is worse than none, because each count is smaller.
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
    model_loss,
    predicting_extracts,
    size_principle_cost,
)
from palpate.core.automata.elman import MOST_HIDDEN, RANGES, Architecture, Readout
from palpate.core.automata.machine import Machine
from palpate.core.automata.strings import PrefixTree, Strings
from palpate.core.automata.training import OnProgress, TrainedNetwork, Training, TrainingSettings, train
from palpate.core.errors import ConfigurationError
from palpate.core.ports import OneOf, Range, Settings


@dataclass(frozen=True, slots=True, kw_only=True)
class InferenceSettings(Settings):
    """Settings for inferring an automaton from strings."""

    TABLE: ClassVar[str] = "inference"

    hidden: Annotated[int, Range(1, MOST_HIDDEN)] = 2
    """Number of hidden units; the paper uses 2."""
    activation: Annotated[str, OneOf(*RANGES)] = "sigmoid"
    """Activation function: sigmoid or tanh."""
    order: Annotated[int, OneOf(1, 2)] | None = None
    """1 for Elman networks, in which all symbols share the recurrent weights; 2 for second-order networks, in which
    each symbol has its own. Default: 2 for labelled strings, else 1."""
    training: TrainingSettings = field(default_factory=TrainingSettings)
    """Settings for training the networks."""
    extraction: ExtractionSettings = field(default_factory=ExtractionSettings)
    """Settings for extracting the automata."""
    finalists: Annotated[int, Range(1, 100_000)] = 16
    """Number of top-ranked networks to extract automata from."""
    held_out: Annotated[float, Range(0.0, 0.9)] = 0.2
    """Fraction of the strings held out from training; 0 holds out none. Prediction needs held-out strings."""


@dataclass(frozen=True, slots=True, eq=False)
class Inference:
    """Inference results.

    Attributes:
        chosen: The chosen automaton. For prediction, the held-out strings determine its q; it is then extracted again
            with all strings.
        extracts: Candidates from the same network, ordered by q; for acceptance, only the chosen automaton.
        baselines: Held-out losses of the baselines (last zero to three symbols), by name; for prediction only.
    """

    chosen: Extract
    extracts: tuple[Extract, ...]
    network: TrainedNetwork
    training: Training
    strings: int
    held_out: int
    baselines: dict[str, float]

    @property
    def machine(self) -> Machine:
        """The minimised automaton."""
        return self.chosen.machine

    @property
    def consistent(self) -> bool | None:
        """Return True if the automaton labels every training string correctly, or None for prediction."""
        return None if self.chosen.wrong is None else not self.chosen.wrong

    @property
    def summary(self) -> str:
        """Short summary of the results."""
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
            baselines = ", ".join(f"{name} {loss:.4f}" for name, loss in self.baselines.items())
            lines.append(
                f"cross-entropy on {self.held_out} held-out strings: {chosen.loss:.4f} nats per symbol; {baselines}"
            )
        return "\n".join(lines)


def infer(
    strings: Strings, settings: InferenceSettings | None = None, *, progress: OnProgress | None = None
) -> Inference:
    """Infer an automaton from strings.

    Returns:
        The best automaton found, even if it does not label every string correctly (see ``consistent``).

    Raises:
        ConfigurationError: The settings do not match the strings.
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
    baselines: dict[str, float] = {}
    if held_tree is not None and reading is Readout.PREDICTION:
        network, extracts = _predictor(finalists, tree, held_tree, settings.extraction)
        machines = {f"last {count}": last_symbols(tree, count) for count in range(4)}
        baselines = {name: model_loss(machine, tree, held_tree) for name, machine in machines.items()}
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
        baselines=baselines,
    )


def _acceptor(
    finalists: Sequence[TrainedNetwork], tree: PrefixTree, held_out: PrefixTree | None, settings: ExtractionSettings
) -> tuple[TrainedNetwork, tuple[Extract, ...]]:
    """Return the automaton with the fewest errors; break ties by fewest states, then by lowest size-principle cost."""
    found = [accepting_extract(trained.network, tree, settings, held_out) for trained in finalists]
    costs = [(extract.cost, extract.states, size_principle_cost(extract.machine, tree)) for extract in found]
    best = costs.index(min(costs))
    return finalists[best], (found[best],)


def _predictor(
    finalists: Sequence[TrainedNetwork], tree: PrefixTree, held_out: PrefixTree, settings: ExtractionSettings
) -> tuple[TrainedNetwork, tuple[Extract, ...]]:
    """Return the network whose automaton has the lowest cost, and all its automata."""
    found = [(trained, predicting_extracts(trained.network, tree, settings, held_out)) for trained in finalists]
    return min(found, key=lambda pair: cheapest(pair[1]).cost)


def _whole(chosen: Extract, tree: PrefixTree, settings: ExtractionSettings) -> Extract:
    """Extract the automaton again from all strings, unless it then has too many states, and label its states."""
    cells = settings.partition(chosen.partition.network, chosen.intervals, tree) or chosen.partition
    return replace(chosen, partition=cells, machine=labelled(cells.minimal(settings.least_share), tree))
