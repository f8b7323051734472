"""Plots of a run's trials."""

from collections.abc import Sequence
from typing import Any, Final

from palpate.adapters.experiments.results import TrialRow
from palpate.adapters.experiments.statistics import WINDOW, moving_average
from palpate.adapters.log import drawing

_MARGINS: Final = {"left": 0.08, "right": 0.98, "bottom": 0.16, "top": 0.93, "hspace": 0.12}
"""Fixed plot margins, because measuring labels takes longer than the rest of the drawing."""


def learning_curve(rows: Sequence[TrialRow], title: str) -> bytes:
    """Return a PNG of exploration times, numbered as in ``trials.csv``, and their average (the paper's figure 5)."""
    with drawing(8.0, 4.2, 120, layout=None) as canvas:
        axes: Any = canvas.figure.add_axes((0.08, 0.19, 0.9, 0.72))
        _scatter(axes, rows, [row.exploration_time_s for row in rows])
        if len(rows) > WINDOW:
            means = moving_average([row.exploration_time_s for row in rows])[WINDOW - 1 :]
            trials = [row.trial for row in rows[WINDOW - 1 :]]
            axes.plot(trials, means, color="black", linewidth=1.8, label=f"moving average of {WINDOW}")
        if rows:
            _legend(axes)
        axes.set(xlabel="trial", ylabel="exploration time [s]", title=title)
    return canvas.content


def trials_picture(rows: Sequence[TrialRow], title: str, limit_N: float, kind: str = "png") -> bytes:
    """Return a figure with the exploration time and peak force of every trial, and the force limit of the job."""
    with drawing(8.0, 5.2, 120, kind, layout=None) as canvas:
        upper, lower = canvas.figure.subplots(2, 1, sharex=True, gridspec_kw=_MARGINS)
        _scatter(upper, rows, [row.exploration_time_s for row in rows])
        _scatter(lower, rows, [row.peak_force_N for row in rows], limit_N)
        lower.axhline(limit_N, color="#a3232b", linewidth=1.0, linestyle="--", label=f"limit {limit_N:g} N")
        _legend(lower)
        upper.set(ylabel="exploration time [s]", title=title)
        lower.set(xlabel="trial", ylabel="peak force [N]")
    return canvas.content


def _legend(axes: Any) -> None:
    """Place the legend below the plot, where it covers no trials."""
    axes.figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)


def _scatter(axes: Any, rows: Sequence[TrialRow], values: Sequence[float], top: float = 0.0) -> None:
    """Draw a mark for each trial, on an axis from zero to slightly above the highest value, or ``top`` if higher."""
    for success, colour, marker, label in (
        (True, "#4878a8", ".", "success"),
        (False, "#c44e52", "x", "no success"),
    ):
        points = [(row.trial, value) for row, value in zip(rows, values, strict=True) if row.success is success]
        if points:
            # Marks at zero extend below the axis.
            axes.scatter(
                *zip(*points, strict=True), s=18, marker=marker, color=colour, alpha=0.6, label=label, clip_on=False
            )
    axes.set_ylim(0.0, 1.1 * max(top, *values) if values else top or 1.0)
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.grid(alpha=0.25)
