"""Pictures of a run. Matplotlib is imported only when one is drawn."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

from palpate.adapters.experiments.results import TrialRow
from palpate.adapters.experiments.statistics import WINDOW, moving_average


def learning_curve(rows: Sequence[TrialRow], title: str) -> bytes:
    """Exploration time of every trial and its moving average, as a PNG (the paper's figure 5)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.2), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes: Any = figure.add_subplot()
    trials = [row.trial + 1 for row in rows]
    times = [row.exploration_time_s for row in rows]
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
    buffer = io.BytesIO()
    # Without a date and a version in it, equal runs give equal pictures.
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()
