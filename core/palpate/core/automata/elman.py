"""Elman networks as values: one-hot symbols in, a hidden state that feeds back, and a reading of it (paper, 5.3).

The hidden state after symbol s is ``f(W h + u)``, with ``W`` and ``u`` of their own for s. In a first-order network the
symbols share ``W``, which is the network of Elman; in a second-order one (Giles and others, 1992) they do not. Where
strings hold actions, the letters, action and symbol together, take the place of the symbols, those of one action share
``W`` in a second-order network, and what follows is predicted for each action that might be taken.

With actions there are normalised hidden layers too: ``N(m (W h))``, where ``m`` keeps the units that belong to the
symbol, ``N`` divides by the sum, and columns of ``W`` are shares. Then what a unit holds is the share of its place
among those that the string may have led to, and the prediction is the sum of ``W h`` over each symbol's units.
"""

import enum
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, TypeAlias

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from palpate.core.automata.letters import END, symbols_in
from palpate.core.automata.prefix_tree import Integers, PrefixTree
from palpate.core.errors import ConfigurationError
from palpate.core.ports import OneOf, Range, Settings, write_whole

Array: TypeAlias = npt.NDArray[np.float64]

NORMALISED: Final = "normalised"
RANGES: Final = {"sigmoid": (0.0, 1.0), "tanh": (-1.0, 1.0), NORMALISED: (0.0, 1.0)}
"""Lowest and highest activation of a hidden unit, by the name of the activation function."""

LEAST: Final = 1e-6
"""Of a normalised layer: what every unit of the symbol gets beside, so that nothing is divided by 0."""

MOST_HIDDEN: Final = 128


class Readout(enum.Enum):
    """What is computed of the hidden state."""

    PREDICTION = "prediction"
    """Probabilities of the next symbol and, last, of the end of the string; with actions so for each action."""
    ACCEPTANCE = "acceptance"
    """Probability that the string so far is accepted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Architecture(Settings):
    """Shape of a network; no symbol may have the name of the end."""

    TABLE: ClassVar[str] = "network"

    alphabet: tuple[str, ...]
    """Names of the symbols, or letters, in order."""
    reading: Readout
    """What is computed of the hidden state."""
    hidden: Annotated[int, Range(1, MOST_HIDDEN)] = 2
    """Number of hidden units; the paper has 2."""
    activation: Annotated[str, OneOf(*RANGES)] = "sigmoid"
    """sigmoid or tanh; or normalised, in a second-order network with actions."""
    order: Annotated[int, OneOf(1, 2)] = 1
    """1 for Elman networks, in which all symbols share the recurrent weights; 2 for second-order ones, in which each
    (or each action) has its own."""
    actions: tuple[str, ...] = ()
    """Names of the actions that the letters hold."""

    @override
    def check(self) -> None:
        if END in self.alphabet:
            raise ConfigurationError("network.alphabet", END, "another name; this one means the end of a string")
        symbols_in(self.alphabet, self.actions, "network.alphabet")
        if self.normalised and (not self.actions or self.order != 2 or self.hidden % len(self.names)):
            accepted = f"sigmoid or tanh; {NORMALISED} is for actions, order 2 and as many units for each symbol"
            raise ConfigurationError("network.activation", self.activation, accepted)

    @property
    def normalised(self) -> bool:
        """Whether the hidden layer is normalised."""
        return self.activation == NORMALISED

    @property
    def kept(self) -> Array:
        """Of a normalised layer: 1 for each unit that belongs to the symbol of a letter, else 0, (letters, hidden)."""
        count = len(self.names)
        return np.equal.outer(np.arange(len(self.alphabet)) % count, np.arange(self.hidden) % count).astype(float)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the symbols, without actions."""
        return self.alphabet[: len(self.alphabet) // (len(self.actions) + 1)]

    @property
    def outcomes(self) -> int:
        """Number of outputs: the symbols and the end, so for each action; or one for acceptance."""
        return (len(self.names) + 1) * max(1, len(self.actions)) if self.reading is Readout.PREDICTION else 1

    def matrix_of(self, letters: Integers) -> Integers:
        """Which recurrent weights letters take, of the same shape."""
        if self.order == 1:
            return np.zeros_like(letters)
        return letters // len(self.names) if self.actions else letters

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape of each parameter of a :class:`Network`, by its name."""
        letters, hidden = len(self.alphabet), self.hidden
        matrices = (len(self.actions) + 1 if self.actions else letters) if self.order == 2 else 1
        return {
            "recurrent": (matrices, hidden, hidden),
            "inputs": (letters, hidden),
            "start": (hidden,),
            "output": (self.outcomes, hidden),
            "bias": (self.outcomes,),
        }


@dataclass(frozen=True, slots=True, eq=False)
class Network:
    """One network; ``s`` symbols, ``h`` hidden units, ``k`` outputs.

    Attributes:
        recurrent: Weights from hidden state to hidden state, (s, h, h), or (1, h, h) of first order; with a actions
            (a + 1, h, h), the first for the start.
        inputs: What a symbol adds before the activation function, (s, h); the bias is in it. In a normalised layer
            what it multiplies by, :attr:`Architecture.kept`.
        start: Hidden state of the empty string before the activation function, (h,).
        bias: Bias of the outputs, (k,).
    """

    architecture: Architecture
    recurrent: Array
    inputs: Array
    start: Array
    output: Array
    bias: Array

    def __post_init__(self) -> None:
        for name, shape in self.architecture.shapes.items():
            given = getattr(self, name)
            try:
                values = np.array(given, dtype=np.float64)
            except (TypeError, ValueError) as error:
                raise ConfigurationError(f"network.{name}", given, f"finite numbers, shape {shape}") from error
            if values.shape != shape or not np.isfinite(values).all():
                found = f"shape {values.shape}" if values.shape != shape else "a number that is not finite"
                raise ConfigurationError(f"network.{name}", found, f"finite numbers, shape {shape}")
            values.setflags(write=False)
            object.__setattr__(self, name, values)

    @property
    def start_state(self) -> Array:
        """Hidden state of the empty string, (h,)."""
        return self._activated(self.start)

    def after(self, hidden: Array, letters: Integers) -> Array:
        """Hidden states after one letter each: (n, h) and (n,) to (n, h)."""
        matrices, drives = self.architecture.matrix_of(letters), np.empty_like(hidden)
        for matrix in np.unique(matrices):  # each in its place: a copy for every row would take most of the time
            rows = np.flatnonzero(matrices == matrix)
            drives[rows] = (self.recurrent[matrix] @ hidden[rows, :, np.newaxis])[:, :, 0]
        return self._entered(drives, self.inputs[letters])

    def advance(self, hidden: Array, letter: int) -> Array:
        """Hidden states after one letter: (n, h) to (n, h)."""
        weights = self.recurrent[int(self.architecture.matrix_of(np.array(letter)))]
        return self._entered(hidden @ weights.T, self.inputs[letter])

    def read(self, hidden: Array) -> Array:
        """Probabilities of the outcomes: (n, h) to (n, k). With actions they sum to 1 for each of them."""
        drives = hidden @ self.output.T + self.bias
        if self.architecture.reading is Readout.ACCEPTANCE:
            return _sigmoid(drives)
        if self.architecture.normalised:
            return drives
        drives = drives.reshape(len(hidden), -1, len(self.architecture.names) + 1)
        raised = np.exp(drives - drives.max(axis=2, keepdims=True))
        shares: Array = (raised / raised.sum(axis=2, keepdims=True)).reshape(len(hidden), -1)
        return shares

    def hidden_states(self, tree: PrefixTree) -> Array:
        """Hidden state at each node of a prefix tree, (n, h)."""
        self.require_alphabet(tree.alphabet)
        hidden = np.empty((len(tree.parents), self.architecture.hidden))
        hidden[0] = self.start_state
        for level in tree.blocks():
            for symbol, first, last in level:
                hidden[first:last] = self.advance(hidden[tree.parents[first:last]], symbol)
        return hidden

    def require_alphabet(self, alphabet: tuple[str, ...]) -> None:
        """Refuse another alphabet than that of the network: the numbers of its symbols would mean other things."""
        if tuple(alphabet) != self.architecture.alphabet:
            raise ConfigurationError(
                "network.alphabet", tuple(alphabet), f"the network's own: {', '.join(self.architecture.alphabet)}"
            )

    def _entered(self, fed_back: Array, inputs: Array) -> Array:
        normalised = self.architecture.normalised
        return self._activated((fed_back + LEAST) * inputs if normalised else fed_back + inputs)

    def _activated(self, drives: Array) -> Array:
        if self.architecture.normalised:
            shares: Array = drives / drives.sum(axis=-1, keepdims=True)
            return shares
        if self.architecture.activation == "tanh":
            states: Array = np.tanh(drives)
            return states
        return _sigmoid(drives)


def _sigmoid(drives: Array) -> Array:
    # By tanh, which does not overflow where exp(-x) would.
    shares: Array = 0.5 * np.tanh(0.5 * drives) + 0.5
    return shares


SCHEMA: Final = "palpate.elman/1"


def network_to_dict(network: Network) -> dict[str, Any]:
    """Write a network as plain JSON values."""
    shape = network.architecture
    about = {"alphabet": list(shape.alphabet), "reading": shape.reading.value, "hidden": shape.hidden}
    about |= {"activation": shape.activation, "order": shape.order}
    about |= {"actions": list(shape.actions)} if shape.actions else {}
    return {"schema": SCHEMA, **about, **{name: getattr(network, name).tolist() for name in shape.shapes}}


def save_network(network: Network, path: str | os.PathLike[str]) -> None:
    """Write a network file; an older one of the name is replaced.

    Raises:
        OutputError: The place cannot be written to.
    """
    text = json.dumps(network_to_dict(network), indent=1, allow_nan=False) + "\n"
    write_whole(Path(path), text)
