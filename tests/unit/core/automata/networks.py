"""Networks by hand, whose automata are known."""

from itertools import pairwise

import numpy as np

from palpate.core.automata.elman import Architecture, Network, Readout

LARGE = 20.0


def parity():
    """One second-order unit: 0 keeps it, 1 turns it over; accepts an even number of 1."""
    shape = Architecture(alphabet=("0", "1"), reading=Readout.ACCEPTANCE, hidden=1, order=2)
    return Network(
        shape,
        recurrent=[[[LARGE]], [[-LARGE]]],
        inputs=[[-LARGE / 2], [LARGE / 2]],
        start=[-LARGE / 2],
        output=[[-LARGE]],
        bias=[LARGE / 2],
    )


def last_symbol():
    """Two first-order units that hold the last symbol; a symbol is followed by the other one, or by the end after b."""
    shape = Architecture(alphabet=("a", "b"), reading=Readout.PREDICTION)
    return Network(
        shape,
        recurrent=[[[0.0, 0.0], [0.0, 0.0]]],
        inputs=[[LARGE, -LARGE], [-LARGE, LARGE]],
        start=[-LARGE, -LARGE],
        output=[[0.0, LARGE], [LARGE, 0.0], [0.0, 1.25 * LARGE]],
        bias=[0.0, 0.0, -LARGE / 4],
    )


def drift():
    """One tanh unit that a moves up by little, so that q determines how many steps are distinguished; b resets it."""
    shape = Architecture(alphabet=("a", "b"), reading=Readout.PREDICTION, hidden=1, activation="tanh", order=2)
    return Network(
        shape,
        recurrent=[[[1.0]], [[0.0]]],
        inputs=[[0.5], [-2.0]],
        start=[-2.0],
        output=[[0.0], [0.0], [4.0]],
        bias=[0.0, 0.0, 0.0],
    )


def hidden_states(network, tree):
    """Hidden state at each node of a prefix tree."""
    hidden = np.empty((len(tree.parents), network.architecture.hidden))
    hidden[0] = network.start_state
    for first, last in pairwise(tree.levels[1:].tolist()):
        hidden[first:last] = network.after(hidden[tree.parents[first:last]], tree.symbols[first:last])
    return hidden
