"""Figures as files: equal contents give equal bytes. Matplotlib is imported only when one is drawn."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Final, Literal

from palpate.adapters.experiments.results import TrialRow
from palpate.adapters.experiments.statistics import WINDOW, moving_average

_NOTHING: Final = {"svg": {"Date": None, "Creator": None}, "png": {"Software": None}}
"""No date and no version in the file."""


class Canvas:
    """A picture in the making.

    Attributes:
        figure: Matplotlib's figure.
        content: The finished file, once the ``with`` block that gave the canvas is left.
    """

    def __init__(self, figure: Any) -> None:
        self.figure, self.content = figure, b""


@contextmanager
def drawing(
    width_in: float,
    height_in: float,
    dpi: int,
    kind: str = "png",
    settings: Mapping[str, Any] | None = None,
    layout: Literal["constrained"] | None = "constrained",
) -> Iterator[Canvas]:
    """Gives an empty canvas to draw on; when the block ends its ``content`` is there.

    Args:
        width_in: Width in inches.
        height_in: Height in inches.
        dpi: Pixels per inch.
        kind: ``png`` or ``svg``.
        settings: Matplotlib's parameters, over its own defaults: a matplotlibrc of the user's changes no byte.
        layout: Matplotlib's layout engine; None for none.
    """
    from matplotlib import style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with style.context(["default", {"svg.hashsalt": "palpate", **(settings or {})}]):
        canvas = Canvas(Figure(figsize=(width_in, height_in), dpi=dpi, layout=layout))
        FigureCanvasAgg(canvas.figure)
        yield canvas
        buffer = io.BytesIO()
        canvas.figure.savefig(buffer, format=kind, metadata=_NOTHING[kind])
        canvas.content = buffer.getvalue()


def learning_curve(rows: Sequence[TrialRow], title: str) -> bytes:
    """Exploration time of every trial and its moving average, as a PNG (the paper's figure 5)."""
    trials = [row.trial + 1 for row in rows]
    times = [row.exploration_time_s for row in rows]
    with drawing(8.0, 4.2, 120) as canvas:
        axes: Any = canvas.figure.add_subplot()
        for success, colour, marker, label in (
            (True, "#4878a8", ".", "inserted to full depth"),
            (False, "#c44e52", "x", "not inserted"),
        ):
            points = [(t, s) for t, s, row in zip(trials, times, rows, strict=True) if row.success is success]
            if points:
                axes.scatter(*zip(*points, strict=True), s=18, marker=marker, color=colour, alpha=0.6, label=label)
        if rows:
            axes.plot(trials, moving_average(times), color="black", linewidth=1.8, label=f"moving average of {WINDOW}")
            axes.legend(loc="upper right")
        axes.set(xlabel="trial", ylabel="exploration time [s]", title=title)
        axes.set_ylim(bottom=0.0)
        axes.grid(alpha=0.25)
    return canvas.content
