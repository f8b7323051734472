"""Strings in, automaton out (paper, 3.4 and 5.3).

Networks are trained on the strings, automata made of the best of them by dynamic state partitioning, and the best
automaton is minimised. Labelled strings give an acceptor; positive ones, a Moore machine whose states give what may
come next.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from palpate.core.automata.choice import Extract, ExtractionSettings, accepting_extract, cheapest, predicting_extracts
from palpate.core.automata.elman import Architecture, Array, HiddenLayer, Readout
from palpate.core.automata.machine import Machine
from palpate.core.automata.prefix_tree import Integers, PrefixTree
from palpate.core.automata.strings import Strings
from palpate.core.automata.training import OnProgress, TrainedNetwork, Training, TrainingSettings, train
from palpate.core.errors import ConfigurationError
from palpate.core.ports import Range


@dataclass(frozen=True, slots=True, kw_only=True)
class InferenceSettings(HiddenLayer):
    """How to come from strings to an automaton."""

    TABLE: ClassVar[str] = "inference"

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
        chosen: The automaton with its q, its raw and minimal numbers of states and its agreement.
        extracts: Those of the same network that it was chosen from, by q; for acceptance itself alone.
        strings: How many strings the networks were trained on.
        held_out: How many were held out.
        hidden: For a picture: hidden states at all prefixes of the training strings, (n, hidden units).
        cells: State, before minimisation, of the automaton at the same prefixes, (n,).
    """

    chosen: Extract
    extracts: tuple[Extract, ...]
    network: TrainedNetwork
    training: Training
    strings: int
    held_out: int
    hidden: Array
    cells: Integers

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
            what = "prefixes of held-out strings" if chosen.wrong is None else "held-out strings"
            lines.append(f"agreement: {chosen.agreement:.1%} of the {what} ({self.held_out} strings)")
        if chosen.loss is not None:
            lines.append(f"cross-entropy on held-out strings: {chosen.loss:.4f} nats a symbol")
        return "\n".join(lines)


def infer(
    strings: Strings,
    settings: InferenceSettings | None = None,
    *,
    held_out: Strings | None = None,
    progress: OnProgress | None = None,
) -> Inference:
    """Infer an automaton from strings.

    Args:
        strings: Labelled ones give an acceptor, positive ones a Moore machine.
        settings: How; None takes the defaults.
        held_out: Strings that nothing is trained on; None splits them off.
        progress: Called now and then while networks are trained.

    Returns:
        The best that was found, also if no automaton is right about every string (``consistent``).

    Raises:
        ConfigurationError: Settings that do not fit the strings.
    """
    settings = settings or InferenceSettings()
    if held_out is None and settings.held_out:
        strings, held_out = strings.split(settings.held_out, settings.training.seed)
    reading = Readout.ACCEPTANCE if strings.labelled else Readout.PREDICTION
    shape = Architecture(
        alphabet=strings.alphabet,
        reading=reading,
        hidden=settings.hidden,
        activation=settings.activation,
        order=settings.order,
    )
    tree = PrefixTree.of(strings)
    held_tree = None if held_out is None else PrefixTree.of(_alike(held_out, strings))
    if held_tree is None and reading is Readout.PREDICTION:
        raise ConfigurationError("inference.held_out", 0.0, "above 0: held-out strings choose q")
    training = train(strings, shape, settings.training, progress)
    finalists = training.networks[: settings.finalists]
    if held_tree is not None and reading is Readout.PREDICTION:
        network, extracts = _predictor(finalists, tree, held_tree, settings.extraction)
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
        hidden=network.network.hidden_states(tree),
        cells=tree.states(chosen.partition.transitions),
    )


def _alike(held_out: Strings, strings: Strings) -> Strings:
    """The held-out strings, if they are of the same sort."""
    if held_out.alphabet != strings.alphabet:
        raise ConfigurationError("held_out.alphabet", held_out.alphabet, f"that of the strings, {strings.alphabet}")
    if held_out.labelled is not strings.labelled:
        accepted = "labels" if strings.labelled else "no labels"
        raise ConfigurationError("held_out.labels", held_out.labels, f"{accepted}, as of the other strings")
    return held_out


def _acceptor(
    finalists: Sequence[TrainedNetwork], tree: PrefixTree, held_out: PrefixTree | None, settings: ExtractionSettings
) -> tuple[TrainedNetwork, tuple[Extract, ...]]:
    """The smallest of the automata that are right most often; of equally small ones that which most networks gave."""
    found = [accepting_extract(trained.network, tree, settings, held_out) for trained in finalists]
    votes = Counter(extract.machine for extract in found)
    places = range(len(found))
    best = min(places, key=lambda place: (found[place].cost, found[place].states, -votes[found[place].machine]))
    return finalists[best], (found[best],)


def _predictor(
    finalists: Sequence[TrainedNetwork], tree: PrefixTree, held_out: PrefixTree, settings: ExtractionSettings
) -> tuple[TrainedNetwork, tuple[Extract, ...]]:
    """The cheapest of all automata."""
    found = [(trained, predicting_extracts(trained.network, tree, settings, held_out)) for trained in finalists]
    return min(found, key=lambda pair: cheapest(pair[1]).cost)
