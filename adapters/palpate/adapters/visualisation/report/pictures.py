"""Pictures for studies: learning curves, and success and time plotted against a setting."""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any, Final

import numpy as np

from palpate.adapters import experiments
from palpate.adapters.log import Canvas, drawing
from palpate.adapters.visualisation.report.page import Picture

# Colours that are distinguishable with any colour vision (Okabe and Ito).
COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#aa4499", "#000000", "#e69f00", "#56b4e9", "#999933")
GREY: Final = "#6b7280"
WIDTH_IN: Final = 6.2
_STYLE: Final = {
    "font.size": 11.0, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.alpha": 0.25,
    "text.usetex": False, "text.parse_math": False,
}  # fmt: skip
Runs = Sequence[Sequence[experiments.TrialRow]]
"""Trials from runs that differ only in the seed."""


def drawn(height_in: float, width_in: float = WIDTH_IN) -> AbstractContextManager[Canvas]:
    """Yield an empty canvas. Its ``content`` is available after the block."""
    return drawing(width_in, height_in, 150, settings=_STYLE)


def mean_s(rows: Sequence[experiments.TrialRow]) -> float:
    """Return the mean exploration time."""
    return sum(row.exploration_time_s for row in rows) / len(rows)


def learning_picture(
    curves: Mapping[str, Runs], levels: Mapping[str, Sequence[experiments.TrialRow]], title: str = ""
) -> Picture:
    """Plot time and success over the trials: learners as curves with t intervals, and other policies as lines."""
    ends = []
    with drawn(5.0) as canvas:
        upper, lower = canvas.figure.subplots(2, 1, sharex=True, height_ratios=(1.9, 1.0))
        for colour, (name, runs) in zip(COLOURS * len(curves), curves.items(), strict=False):
            times = _averages([[row.exploration_time_s for row in rows] for rows in runs])
            wins = _averages([[float(row.success) for row in rows] for rows in runs])
            trials = np.arange(times.shape[1]) + experiments.window_of(min(map(len, runs))) - 1
            for axes, values, most in ((upper, times, np.inf), (lower, wins, 1.0)):
                middle = values.mean(axis=0)
                if len(runs) > 1:
                    half = experiments.t_half_width(values)
                    band = np.clip((middle - half, middle + half), 0.0, most)
                    axes.fill_between(trials, *band, color=colour, alpha=0.2)
                axes.plot(trials, middle, color=colour, linewidth=1.8, label=name)
            ends.append(f"{name}: {times[:, 0].mean():.3g} s at first, {times[:, -1].mean():.3g} s at the end")
        for line, (name, rows) in zip(("--", "-.", ":") * len(levels), levels.items(), strict=False):
            upper.axhline(mean_s(rows), color=GREY, linestyle=line, linewidth=1.3, label=name)
            lower.axhline(sum(row.success for row in rows) / len(rows), color=GREY, linestyle=line, linewidth=1.3)
            ends.append(f"{name}: {mean_s(rows):.3g} s")
        upper.set(ylabel="exploration time [s]", ylim=(0.0, None))
        lower.locator_params(axis="x", integer=True)
        lower.set(xlabel="trial", ylabel="success", ylim=(-0.04, 1.04))
        canvas.figure.legend(*upper.get_legend_handles_labels(), loc="outside upper left", ncols=2, frameon=False)
    caption = (
        f"{title}Lines: moving average over {experiments.WINDOW} trials, or individual trials if there are fewer than"
        f" {2 * experiments.WINDOW}. Bands: 95 % interval of the mean over seeds (Student's t). Failed trials are"
        " included with their actual duration."
    )
    return Picture(f"Learning curve. {title}{'; '.join(ends)}.", caption, canvas.content)


def _averages(values: Sequence[Sequence[float]]) -> Any:
    """Return moving averages over the trials that all runs have, from the first full window, as (runs, trials)."""
    trials = min(map(len, values))
    window = experiments.window_of(trials)
    return np.array([experiments.moving_average(run[:trials], window) for run in values])[:, window - 1 :]


def sweep_picture(field: str, values: Sequence[str], lines: Mapping[str, Mapping[str, Runs]]) -> Picture:
    """Plot time (above) and success (below) against the values of a setting, for each policy and seed."""
    described = []
    with drawn(5.0) as canvas:
        upper, lower = canvas.figure.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
        for number, (name, points) in enumerate(lines.items()):
            colour, aside = COLOURS[number % len(COLOURS)], 0.3 * (number + 0.5) / len(lines) - 0.15
            for value, runs in points.items():
                place = values.index(value) + aside
                mean, low, high = experiments.mean_with_interval([mean_s(rows) for rows in runs])
                rows = [row for one in runs for row in one]
                wins = sum(row.success for row in rows)
                label = name if value == next(iter(points)) else None
                upper.plot([place], [mean], "o", color=colour, label=label)
                lower.plot([place], [wins / len(rows)], "o", color=colour)
                if low is not None and high is not None:
                    upper.vlines(place, low, high, color=colour)
                lower.vlines(place, *experiments.exact_interval(wins, len(rows)), color=colour)
                described.append(f"{name} at {value}: {mean:.3g} s")
        upper.set(ylabel="mean time [s]", ylim=(0.0, None))
        lower.set(xlabel=field, ylabel="success", ylim=(-0.04, 1.04))
        lower.set_xticks(range(len(values)), values)
        canvas.figure.legend(*upper.get_legend_handles_labels(), loc="outside upper left", ncols=2, frameon=False)
    caption = "Bars: 95 % intervals; Student's t over seeds for times, exact over trials for success."
    return Picture(f"Mean time and success against {field}. {'; '.join(described)}.", caption, canvas.content)
