"""The picture of an inference: its hidden space."""

from typing import Final

import numpy as np

from palpate.adapters.log import drawing
from palpate.core.automata import Inference

_MOST_CELLS: Final = 40
"""Cells are named in the picture up to this number."""


def hidden_picture(inference: Inference) -> bytes:
    """The first two hidden units at all prefixes of the training strings, by cell, with the cells' borders: a PNG."""
    chosen = inference.chosen
    hidden, cells = np.asarray(inference.hidden), np.asarray(inference.cells)
    with drawing(7.0, 6.4, 110) as canvas:
        axes = canvas.figure.add_subplot()
        across = 1 if hidden.shape[1] > 1 else 0
        axes.scatter(hidden[:, 0], hidden[:, across], c=cells % 20, cmap="tab20", s=14, linewidths=0)
        low = -1.0 if inference.network.network.architecture.activation == "tanh" else 0.0
        for border in np.linspace(low, 1.0, chosen.intervals + 1):
            axes.axvline(border, color="0.8", linewidth=0.7, zorder=0)
            axes.axhline(border, color="0.8", linewidth=0.7, zorder=0)
        if len(chosen.partition.vectors) <= _MOST_CELLS:
            for number, vector in enumerate(chosen.partition.vectors):
                place = (float(vector[0]), float(vector[across]))
                # A state of the automaton, s0 where it has no name, may be several cells: it is none of these numbers.
                axes.annotate(f"c{number}", place, textcoords="offset points", xytext=(4, 4), fontsize=8)
        axes.set_xlabel("hidden unit 1")
        axes.set_ylabel(f"hidden unit {across + 1}")
        more = "" if hidden.shape[1] <= 2 else f" (2 of {hidden.shape[1]} units)"
        sizes = f"{chosen.raw_states} cells (c), {chosen.states} states when minimised"
        axes.set_title(f"Hidden states, q = {chosen.intervals}: {sizes}{more}", fontsize=10)
    return canvas.content
