"""Learning curves: how long trials took and how many came to a good end, trial by trial."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from palpate.adapters.experiments import WINDOW, Array, moving_average, t_half_width, window_of
from palpate.adapters.visualisation.report.canvas import COLOURS, GREY, LINES, drawn, legend_above
from palpate.adapters.visualisation.report.page import Picture, counted, share


@dataclass(frozen=True)
class LearningCurve:
    """The trials of equal runs that differ in their seed only.

    Attributes:
        costs: Time of each trial of each run, in s: (runs) tuples of (trials).
    """

    label: str
    costs: tuple[tuple[float, ...], ...]
    successes: tuple[tuple[bool, ...], ...]

    @property
    def trials(self) -> int:
        """Trials that every run has."""
        return min(map(len, self.costs))


@dataclass(frozen=True)
class ReferenceLevel:
    """Something that does not learn, and stands beside a curve as a line.

    Attributes:
        cost: Its mean time, s.
        success: Its share of good ends.
    """

    label: str
    cost: float
    success: float


def learning_picture(
    name: str,
    curves: Sequence[LearningCurve],
    levels: Sequence[ReferenceLevel] = (),
    *,
    highest_s: float | None = None,
    ceiling_s: float = inf,
) -> Picture:
    """Time above and success below, over the trials, of one or more curves with a trial or more.

    A single curve of a single run has its trials as dots; several runs have a band, the t interval of their mean, which
    may leave the picture: two runs have one that is many times as high as all that was measured.

    Args:
        highest_s: Upper end of the axis of times, for pictures that are to be compared; None takes it from the data.
        ceiling_s: No mean is above this, so no band is.
    """
    tops = [level.cost for level in levels]
    with drawn(5.0) as canvas:
        upper, lower = canvas.figure.subplots(2, 1, sharex=True, height_ratios=(1.9, 1.0))
        for number, curve in enumerate(curves):
            tops.append(_draw(upper, lower, curve, COLOURS[number % len(COLOURS)], ceiling_s, dots=len(curves) == 1))
        for number, level in enumerate(levels):
            style: dict[str, Any] = {"color": GREY, "linewidth": 1.3, "linestyle": LINES[1 + number % (len(LINES) - 1)]}
            upper.axhline(level.cost, label=level.label, **style)
            lower.axhline(level.success, **style)
        upper.set_ylim(0.0, (1.08 * max(tops) if highest_s is None else highest_s) or 1.0)
        upper.set_ylabel("exploration time [s]")
        lower.set(xlabel="trial", ylabel="success", ylim=(-0.04, 1.04))
        lower.yaxis.set_major_formatter(lambda value, _: f"{value:.0%}")
        lower.set_xlim(-0.5, max(max(map(len, c.costs)) for c in curves) - 0.5)
        lower.xaxis.get_major_locator().set_params(integer=True)
        legend_above(canvas.figure, upper)
    return Picture(name, _alt(curves, levels), _caption(curves), canvas.content)


def means_of(values: Sequence[Sequence[float]], trials: int) -> Array:
    """Moving averages of equally long beginnings of runs, (runs, trials)."""
    return np.array([moving_average(run[:trials], window_of(trials)) for run in values])


def _draw(upper: Any, lower: Any, curve: LearningCurve, colour: str, ceiling: float, *, dots: bool) -> float:
    """Draw a curve; returns the highest cost that is drawn, but for bands."""
    runs, trials, top = len(curve.costs), np.arange(curve.trials), 0.0
    window = window_of(curve.trials)
    whole = slice(window - 1, None)
    dots &= runs == 1
    if dots:
        costs, wins = np.array(curve.costs[0]), np.array(curve.successes[0])
        for kind, marker, shade in ((wins, "o", colour), (~wins, "x", COLOURS[1])):
            if kind.any():
                label = "trial, good end" if marker == "o" else "trial, no good end"
                top = float(costs.max())
                upper.scatter(trials[kind], costs[kind], s=22, marker=marker, color=shade, alpha=0.55, label=label)
        colour = "black"
    for axes, values, most in ((lower, curve.successes, 1.0), (upper, curve.costs, ceiling)):
        # Only where the window is full.
        means = means_of(values, curve.trials)[:, whole]
        middle = means.mean(axis=0)
        if runs > 1:
            half = t_half_width(means)
            low, high = np.clip(middle - half, 0.0, most), np.clip(middle + half, 0.0, most)
            axes.fill_between(trials[whole], low, high, color=colour, alpha=0.2, linewidth=0.0)
        # Dots of single trials need no line from one to the next.
        if window > 1 or not dots or axes is lower:
            axes.plot(trials[whole], middle, color=colour, linewidth=1.8, label=curve.label)
    return max(top, float(middle.max()))


def _caption(curves: Sequence[LearningCurve]) -> str:
    windows = {window_of(curve.trials) for curve in curves}
    text = f"Lines: moving average over the last {WINDOW} trials"
    if windows != {WINDOW}:
        text = f"{text}, or trial by trial where there are fewer" if WINDOW in windows else "Lines: trial by trial"
    seeds = sorted({len(curve.costs) for curve in curves})
    if seeds == [1]:
        text += ", of one run; one run alone gives no interval over seeds"
    else:
        number = f"{seeds[0]}" if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]}"
        text += f", mean of {number} seeds. Bands: 95 % interval of that mean (Student's t over seeds)"
    text += "."
    if any(len(run) != curve.trials for curve in curves for run in curve.costs):
        text += " Curves end where the shortest run ends."
    return f"{text} Trials that fail count with the time they took."


def _alt(curves: Sequence[LearningCurve], levels: Sequence[ReferenceLevel]) -> str:
    parts = []
    for curve in curves[:8]:
        window = window_of(curve.trials)
        ends = means_of(curve.costs, curve.trials).mean(axis=0)
        wins = means_of(curve.successes, curve.trials).mean(axis=0)
        first = ends[window - 1]
        parts.append(
            f"{curve.label}: {first:.3g} s after {counted(window, 'trial')}, {ends[-1]:.3g} s at"
            f" trial {curve.trials - 1}, success {share(float(wins[-1]))} there"
        )
    parts += [f"{level.label}: {level.cost:.3g} s" for level in levels]
    return f"Learning curve. {'; '.join(parts)}."
