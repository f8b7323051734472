"""Pictures of what was learned: the hidden space and the training of an inference, and a model of offsets."""

from typing import Any, Final

import numpy as np

from palpate.adapters.log import drawing
from palpate.core.automata import Inference
from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief import Floats
from palpate.core.policy.memory import MemoryDocument, OffsetModel

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


def training_picture(inference: Inference) -> bytes:
    """Lowest and median loss of each batch of networks, by step; a PNG file."""
    from matplotlib.ticker import LogFormatter

    with drawing(7.0, 4.2, 110) as canvas:
        axes = canvas.figure.add_subplot()
        curve = inference.training.curve
        for number, first in enumerate(sorted({point.restart for point in curve})):
            points = [point for point in curve if point.restart == first]
            steps = [point.step for point in points]
            colour = f"C{number % 10}"
            axes.plot(
                steps, [point.best_loss for point in points], color=colour, label=f"networks from {first}: lowest"
            )
            axes.plot(steps, [point.median_loss for point in points], color=colour, linestyle=":", label="median")
        axes.set_xlabel("step")
        axes.set_ylabel("training loss, nats")
        axes.set_yscale("log")
        # 1.2, and not 1.2 x 10^0; over two decades and more powers of ten alone.
        axes.yaxis.set_major_formatter(LogFormatter())
        axes.yaxis.set_minor_formatter(LogFormatter(minor_thresholds=(2.0, 0.5)))
        axes.grid(visible=True, color="0.9")
        axes.legend(fontsize=8)
        axes.set_title(inference.training.summary, fontsize=9)
    return canvas.content


_BLOCKED: Final = 0.5  # a side is drawn as a wall from this probability on
# Colours that differ for any colour vision (Okabe and Ito), and greys of them where a symbol is not sure.
_COLOURS: Final = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442", "#999999")


def memory_picture(
    document: MemoryDocument, belief: Floats, after: str, kind: str, short: tuple[str, ...] = ()
) -> bytes:
    """Draw the model of a memory file.

    Args:
        short: What stands for the symbols, each no longer than a cell is wide; without it, their names.

    Raises:
        ConfigurationError: It has no model of offsets.
    """
    models = document.world_models()
    if not models or not isinstance(models[0], OffsetModel):
        raise ConfigurationError("file", document.kind, "one with a model of offsets; no other is laid out in space")
    model, short = models[0], short or document.symbols
    with drawing(10.0, 5.2, 110, kind) as canvas:
        left, right = canvas.figure.subplots(1, 2)
        for place, (u, v) in enumerate(model.offsets):
            best = int(model.emissions[place].argmax())
            share = float(model.emissions[place, best])
            _cell(left, (u, v), _COLOURS[best % len(_COLOURS)], 0.15 + 0.65 * share, short[best])
            _cell(right, (u, v), "#0072b2", float(belief[place] / max(belief.max(), 1e-12)), _hundredths(belief[place]))
            for action, (du, dv) in enumerate(model.steps):
                if abs(du) + abs(dv) == 1 and model.blocked[action, place] >= _BLOCKED:
                    across = 0.5 * abs(dv), 0.5 * abs(du)
                    x, y = u + 0.5 * du, v + 0.5 * dv
                    left.plot((x - across[0], x + across[0]), (y - across[1], y + across[1]), color="black")
        if short != document.symbols:
            told = "   ".join(f"{each} {name}" for each, name in zip(short, document.symbols, strict=True))
            canvas.figure.suptitle(told, fontsize=6)
        left.set_title("most likely symbol; lines: moves that are blocked", fontsize=9)
        right.set_title(f"belief {f'after {after}' if after else 'before a trial'}, in hundredths", fontsize=9)
        for axes in (left, right):
            _cell(axes, (0, 0), "black", 0.9, "")
            axes.set_aspect("equal")
            axes.autoscale_view()
            axes.set(xlabel="from the goal along x, in steps", ylabel="along y, in steps")
    return canvas.content


def _cell(axes: Any, offset: tuple[int, int], colour: str, alpha: float, text: str) -> None:
    from matplotlib.patches import Rectangle

    u, v = offset
    axes.add_patch(Rectangle((u - 0.5, v - 0.5), 1.0, 1.0, facecolor=colour, alpha=alpha, edgecolor="white"))
    axes.text(u, v, text, ha="center", va="center", fontsize=7)


def _hundredths(share: float) -> str:
    return f"{100 * share:.0f}" if share >= 0.005 else ""
