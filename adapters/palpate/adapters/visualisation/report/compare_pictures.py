"""Strategies beside each other: success, time and force of each, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from palpate.adapters.visualisation.report.canvas import COLOURS, drawn
from palpate.adapters.visualisation.report.page import Picture, share

Interval = tuple[float, float | None, float | None]
"""Value, lower and upper end; None twice where no interval can be stated."""


@dataclass(frozen=True)
class Strategy:
    """What a strategy came to.

    Attributes:
        label: Its name.
        success: Share of successes.
        time_s: Median time.
        slow_s: 95th percentile of time.
    """

    label: str
    success: tuple[float, float, float]
    time_s: Interval
    slow_s: Interval


def strategies_picture(name: str, strategies: Sequence[Strategy], caption: str) -> Picture:
    """A line for each strategy, with its success to the left and its times to the right.

    Args:
        name: The picture's file name.
        strategies: At least one, the first at the top.
        caption: How the intervals were made.
    """
    with drawn(1.5 + 0.42 * len(strategies)) as canvas:
        left, right = canvas.figure.subplots(1, 2, sharey=True, width_ratios=(1.0, 1.5))
        for row, strategy in enumerate(strategies):
            _bar(left, row, strategy.success, COLOURS[2], "o")
            _bar(right, row - 0.13, strategy.time_s, COLOURS[0], "o", "median" if row == 0 else None)
            _bar(right, row + 0.13, strategy.slow_s, COLOURS[1], "s", "95th percentile" if row == 0 else None)
        left.set_yticks(range(len(strategies)), [strategy.label for strategy in strategies])
        left.set(xlim=(-0.04, 1.04), xlabel="success", ylim=(len(strategies) - 0.5, -0.5))
        left.xaxis.set_major_formatter(lambda value, _: f"{value:.0%}")
        right.set(xlabel="exploration time [s]")
        right.set_xlim(left=0.0)
        canvas.figure.legend(*right.get_legend_handles_labels(), loc="outside upper right", ncols=2, frameon=False)
    told = [
        f"{s.label}: success {share(s.success[0])}, median {s.time_s[0]:.2f} s, 95th percentile {s.slow_s[0]:.2f} s"
        for s in strategies
    ]
    return Picture(name, f"Success and time of each strategy. {'; '.join(told)}.", caption, canvas.png)


def _bar(axes: Any, place: float, interval: Interval, colour: str, mark: str, label: str | None = None) -> None:
    middle, low, high = interval
    if low is not None:
        axes.hlines(place, low, high, color=colour, linewidth=2.0)
    axes.plot([middle], [place], mark, color=colour, markersize=6, label=label)
