"""Elman networks with one-hot input symbols, a recurrent hidden state, and a readout (paper, 5.3).

The hidden state after symbol s is ``f(W_s h + u_s)``. In a first-order (Elman) network, all symbols share ``W``; in a
second-order network (Giles et al., 1992) each symbol has its own.
"""

import enum
import json
from dataclasses import dataclass
from typing import Annotated, ClassVar, Final, TypeAlias

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from palpate.core.automata.strings import END, Integers
from palpate.core.errors import ConfigurationError
from palpate.core.ports import OneOf, Range, Settings

Array: TypeAlias = npt.NDArray[np.float64]

RANGES: Final = {"sigmoid": (0.0, 1.0), "tanh": (-1.0, 1.0)}
"""Minimum and maximum activation of a hidden unit, keyed by activation function."""

MOST_HIDDEN: Final = 128


class Readout(enum.Enum):
    """Quantity computed from the hidden state."""

    PREDICTION = "prediction"
    """Probability of each possible next symbol, and last, of the end of the string."""
    ACCEPTANCE = "acceptance"
    """Probability that the string so far is accepted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Architecture(Settings):
    """Network architecture; no symbol may use the name reserved for the end."""

    TABLE: ClassVar[str] = "network"

    alphabet: tuple[str, ...]
    """Symbol names, in order."""
    reading: Readout
    """Quantity computed from the hidden state."""
    hidden: Annotated[int, Range(1, MOST_HIDDEN)] = 2
    """Number of hidden units; the paper uses 2."""
    activation: Annotated[str, OneOf(*RANGES)] = "sigmoid"
    """Activation function: sigmoid or tanh."""
    order: Annotated[int, OneOf(1, 2)] = 1
    """1 for Elman networks, in which all symbols share the recurrent weights; 2 for second-order networks, in which
    each symbol has its own."""

    @override
    def check(self) -> None:
        if END in self.alphabet:
            raise ConfigurationError("network.alphabet", END, "another name; this one means the end of a string")

    @property
    def outcomes(self) -> int:
        """Number of outputs: one for each symbol and one for the end, or 1 for acceptance."""
        return len(self.alphabet) + 1 if self.reading is Readout.PREDICTION else 1

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape of each :class:`Network` parameter, keyed by name."""
        symbols, hidden = len(self.alphabet), self.hidden
        return {
            "recurrent": (symbols if self.order == 2 else 1, hidden, hidden),
            "inputs": (symbols, hidden),
            "start": (hidden,),
            "output": (self.outcomes, hidden),
            "bias": (self.outcomes,),
        }


@dataclass(frozen=True, slots=True, eq=False)
class Network:
    """A network with ``s`` symbols, ``h`` hidden units and ``k`` outputs.

    Attributes:
        recurrent: Weights from hidden state to hidden state, (s, h, h), or (1, h, h) for a first-order network.
        inputs: Input weights for each symbol, (s, h), including the bias.
        start: Hidden state for the empty string, before the activation function, (h,).
        bias: Output bias, (k,).
    """

    architecture: Architecture
    recurrent: Array
    inputs: Array
    start: Array
    output: Array
    bias: Array

    def __post_init__(self) -> None:
        for name, shape in self.architecture.shapes.items():
            values = np.array(getattr(self, name), dtype=np.float64).reshape(shape)
            values.setflags(write=False)
            object.__setattr__(self, name, values)

    @property
    def start_state(self) -> Array:
        """Hidden state for the empty string, (h,)."""
        return self._activated(self.start)

    def after(self, hidden: Array, symbols: Integers) -> Array:
        """Feed one symbol, (n,), to each given hidden state, (n, h), and return the next hidden states, (n, h)."""
        drives = np.empty_like(hidden)
        for symbol in np.unique(symbols).tolist():
            rows = np.flatnonzero(symbols == symbol)
            drives[rows] = (self._weights(symbol) @ hidden[rows, :, np.newaxis])[:, :, 0] + self.inputs[symbol]
        return self._activated(drives)

    def read(self, hidden: Array) -> Array:
        """Return the outcome probabilities, (n, k), for hidden states, (n, h). For prediction they sum to 1."""
        drives = hidden @ self.output.T + self.bias
        if self.architecture.reading is Readout.ACCEPTANCE:
            return _sigmoid(drives)
        raised = np.exp(drives - drives.max(axis=1, keepdims=True))
        shares: Array = raised / raised.sum(axis=1, keepdims=True)
        return shares

    def _weights(self, symbol: int) -> Array:
        weights: Array = self.recurrent[symbol if self.architecture.order == 2 else 0]
        return weights

    def _activated(self, drives: Array) -> Array:
        if self.architecture.activation == "tanh":
            states: Array = np.tanh(drives)
            return states
        return _sigmoid(drives)


def _sigmoid(drives: Array) -> Array:
    # tanh does not overflow, but exp(-x) does.
    shares: Array = 0.5 * np.tanh(0.5 * drives) + 0.5
    return shares


SCHEMA: Final = "palpate.elman/1"


def network_text(network: Network) -> str:
    """Return a network file as text."""
    shape = network.architecture
    about = {"schema": SCHEMA, "alphabet": list(shape.alphabet), "reading": shape.reading.value, "hidden": shape.hidden}
    about |= {"activation": shape.activation, "order": shape.order}
    values = {name: getattr(network, name).tolist() for name in shape.shapes}
    return json.dumps({**about, **values}, indent=1, allow_nan=False) + "\n"
