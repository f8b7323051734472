"""Results from learning runs: a readable table, machine-readable values, and a line for every trial.

The mean over the last trials is always shown together with the optimum with full information and the optimum without
it, because an improvement means little if the optimum is unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from statistics import fmean
from typing import Any, Final

from palpate.adapters.experiments.grid.learning import Bounds, LearningRun
from palpate.adapters.experiments.statistics import mean_with_interval, moving_average, window_of
from palpate.adapters.log import aligned, csv_text, drawing
from palpate.simulation.grid import GridMap

LAST: Final = 100
"""Number of trials that are averaged at the beginning and at the end of a run."""
_COLUMNS: Final = ("seed", "trial", "steps", "reached", "start_column", "start_row", "temperature")


@dataclass(frozen=True)
class Score:
    """Outcome of one run."""

    seed: int
    first: float
    last: float
    reached: float

    @classmethod
    def of(cls, run: LearningRun) -> Score:
        """Score a run."""
        reached = fmean([float(walk.reached) for walk in run.walks[-LAST:]])
        return cls(run.seed, fmean(run.steps[:LAST]), fmean(run.steps[-LAST:]), reached)


def score_table(scores: Sequence[Score], bounds: Bounds, trials: int) -> str:
    """Return a table with one line per run, the mean of all runs, and the bounds."""
    count = min(LAST, trials)
    rows = {str(score.seed): (score.first, score.last, score.reached) for score in scores}
    if len(scores) > 1:
        first, last, reached = map(fmean, zip(*rows.values(), strict=True))
        rows["mean"] = first, last, reached
    lines = [("seed", f"first {count}", f"last {count}", "goal reached")]
    lines += [(name, f"{first:.2f}", f"{last:.2f}", f"{share:.0%}") for name, (first, last, share) in rows.items()]
    belief = "not found: it takes too long" if bounds.belief is None else f"{bounds.belief:.2f}"
    return (
        f"{aligned(lines, left=0)}\n"
        "bounds, mean steps\n"
        f"  full information      {bounds.full:.2f}\n"
        f"  belief-state optimum  {belief}\n"
        f"  random walk           {bounds.random_walk:.2f}\n"
    )


def summary(scores: Sequence[Score], bounds: Bounds) -> dict[str, Any]:
    """Return the results as plain values, with a 95 % Student's t interval if there are several runs."""
    middle, *ends = mean_with_interval([score.last for score in scores])
    return {
        "mean_last": round(middle, 4),
        "mean_last_95": [None if end is None else round(end, 4) for end in ends],
        "mean_first": round(fmean([score.first for score in scores]), 4),
        "reached_last": round(fmean([score.reached for score in scores]), 4),
        "full_information": round(bounds.full, 4),
        "belief_optimum": None if bounds.belief is None else round(bounds.belief, 4),
        "random_walk": round(bounds.random_walk, 4),
        "runs": [{name: round(value, 4) for name, value in asdict(score).items()} for score in scores],
    }


def trials_csv(grid: GridMap, runs: Sequence[LearningRun]) -> str:
    """Return CSV with a line for every trial in every run."""
    rows: list[Sequence[Any]] = [_COLUMNS]
    for run in runs:
        for trial, (walk, temperature) in enumerate(zip(run.walks, run.temperatures, strict=True)):
            rows.append([run.seed, trial, walk.steps, walk.reached, *grid.cells[walk.start], temperature])
    return csv_text(rows)


# Colours that are distinguishable with any colour vision (Okabe and Ito).
_RUNS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
_WIDTH_IN, _HEIGHT_IN = 5.2, 3.4


@dataclass(frozen=True)
class Panel:
    """A panel in the figure."""

    title: str
    curves: tuple[tuple[int, ...], ...]
    bounds: Bounds


def learning_figure(panels: Sequence[Sequence[Panel]], kind: str) -> bytes:
    """Draw the smoothed curves in all panels on identical axes."""
    rows, columns = len(panels), len(panels[0])
    with drawing(_WIDTH_IN * columns, _HEIGHT_IN * rows + 0.3, 110, kind) as canvas:
        axes: Any = canvas.figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for row, line in enumerate(panels):
            for column, panel in enumerate(line):
                _draw(axes[row, column], panel)
        # Set after the last curve, because the axis stops adapting to the curves once a limit is set.
        axes[0, 0].set_ylim(bottom=0.0)
        windows = {window_of(len(steps)) for line in panels for panel in line for steps in panel.curves} - {1}
        smoothed = "".join(f",\nmoving average of {window} trials" for window in sorted(windows))
        for row in range(rows):
            axes[row, 0].set_ylabel(f"steps to the goal, one line per run{smoothed}")
        for column in range(columns):
            axes[rows - 1, column].set_xlabel("trial")
    return canvas.content


def _draw(axes: Any, panel: Panel) -> None:
    for number, steps in enumerate(panel.curves):
        window = window_of(len(steps))
        means = moving_average(steps, window)[window - 1 :]
        axes.plot(range(window - 1, len(steps)), means, color=_RUNS[number % len(_RUNS)], linewidth=1.2)
    # The title names these lines, because a legend would hide curves that do not fall.
    facts = [f"random walk {panel.bounds.random_walk:.1f} (dotted)"]
    axes.axhline(panel.bounds.random_walk, color="grey", linewidth=1.0, linestyle=":")
    if panel.bounds.belief is not None:
        facts.insert(0, f"belief-state optimum {panel.bounds.belief:.2f} (dashed)")
        axes.axhline(panel.bounds.belief, color="black", linewidth=1.0, linestyle="--")
    axes.set_title(f"{panel.title}, {len(panel.curves)} runs\n{', '.join(facts)}", fontsize=9)
    axes.set_xlim(0, max(map(len, panel.curves)))
    axes.grid(alpha=0.25)
