"""The paper's figure 3: steps per trial while learning, a panel for each world and each kind of state."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from palpate.adapters.experiments.grid.worlds import Bounds

WINDOW: Final = 25
"""Trials in the moving average, as in the paper."""
# Colours that people with any colour vision can tell apart (Okabe and Ito).
_RUNS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
_WIDTH_IN, _HEIGHT_IN = 5.2, 3.4


@dataclass(frozen=True)
class Panel:
    """One panel of the figure.

    Attributes:
        title: Stands above it.
        curves: Steps of each trial, for each run.
        bounds: What is possible there.
    """

    title: str
    curves: tuple[tuple[int, ...], ...]
    bounds: Bounds


def learning_figure(panels: Sequence[Sequence[Panel]], kind: str) -> bytes:
    """Smoothed curves of all panels, on equal axes.

    Args:
        panels: Rows of panels, equally many in each.
        kind: ``svg`` or ``png``.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows, columns = len(panels), len(panels[0])
    # Equal runs give equal pictures: no date, no version, no random names.
    with mpl.rc_context({"svg.hashsalt": "palpate", "svg.fonttype": "path"}):
        figure = Figure(figsize=(_WIDTH_IN * columns, _HEIGHT_IN * rows + 0.3), dpi=110, layout="constrained")
        FigureCanvasAgg(figure)
        axes: Any = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for row, line in enumerate(panels):
            for column, panel in enumerate(line):
                _draw(axes[row, column], panel)
        # Only now: a limit that is set before the last curve is drawn holds for that curve too.
        axes[0, 0].set_ylim(bottom=0.0)
        for row in range(rows):
            axes[row, 0].set_ylabel("steps to the goal")
        for column in range(columns):
            axes[rows - 1, column].set_xlabel("trial")
        buffer = io.BytesIO()
        nothing = {"Date": None, "Creator": None} if kind == "svg" else {"Software": None}
        figure.savefig(buffer, format=kind, metadata=nothing)
    return buffer.getvalue()


def _draw(axes: Any, panel: Panel) -> None:
    from palpate.adapters.experiments.statistics import moving_average

    for number, steps in enumerate(panel.curves):
        trials = range(1, len(steps) + 1)
        axes.plot(trials, moving_average(steps, WINDOW), color=_RUNS[number % len(_RUNS)], linewidth=1.2)
    # In the title, because a legend would hide curves that do not fall.
    facts = [f"random walk {panel.bounds.random_walk:.1f} (dotted)"]
    axes.axhline(panel.bounds.random_walk, color="grey", linewidth=1.0, linestyle=":")
    if panel.bounds.belief is not None:
        facts.insert(0, f"belief-state optimum {panel.bounds.belief:.2f} (dashed)")
        axes.axhline(panel.bounds.belief, color="black", linewidth=1.0, linestyle="--")
    axes.set_title(f"{panel.title}\n{', '.join(facts)}", fontsize=9)
    axes.set_xlim(0, max(map(len, panel.curves)))
    axes.grid(alpha=0.25)
