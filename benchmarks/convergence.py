"""Trials to convergence over whatever a study varies, with intervals, and the power law that fits best.

    palpate study examples/studies/convergence.toml --out runs/convergence
    python -m benchmarks.convergence runs/convergence --out docs/images/convergence.svg
    palpate study examples/studies/convergence-tabular.toml --out runs/convergence-tabular
    python -m benchmarks.convergence runs/convergence-tabular --late 25 --out docs/images/convergence-tabular.svg

A failure counts 20 s. "Converged" is the first trial from which the mean of the next ten is within 20 % of the mean of
trials 11 to the last, as in benchmarks/belief.py, or with ``--late N`` of the last N. Cells that differ from the
study's base in one setting are on its axis, the settings of perception on that of the number of states; the base itself
is on all of them. A law is a straight line through the logarithms of all seeds, by least squares; its interval has 95 %
of the exponents of as many studies drawn from this one's seeds, with replacement. Laws of other forms are told beside
it, by how well each foretells a value that was left out.
"""

from __future__ import annotations

import argparse
import csv
import json
from collections import defaultdict
from collections.abc import Callable, Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np
from scipy.stats import bootstrap, linregress

from benchmarks.belief import converged
from palpate.adapters.config import RunConfig, overlay, read_toml

FAILED_S = 20.0
STATES = "states"
SHOWN = ("trials to convergence", "exploration, late trials [s]")
TICKS = (0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.7, 1, 1.5, 2, 3, 4, 6, 8, 10, 15, 20, 30, 40, 60, 80)
POWER = "a x^b"
FORMS: Mapping[str, Callable[[np.ndarray], np.ndarray]] = {
    "a": np.zeros_like,
    "a + b x": lambda x: x,
    "a + b x^0.5": np.sqrt,
    "a + b ln x": np.log,
    "a + b / x": lambda x: 1.0 / x,
    "a + b / x^2": lambda x: 1.0 / x**2,
}
"""Laws besides the power: a level, and what rises from it or levels off to it."""
Points = dict[float, list[tuple[float, float]]]
"""By the setting's value: trials to convergence and seconds of late trials, a seed each."""


def times_of(cell: Path) -> np.ndarray:
    with (cell / "trials.csv").open(newline="") as file:
        rows = [(row["success"] == "True", float(row["exploration_time_s"])) for row in csv.DictReader(file)]
    return np.array([time_s if success else FAILED_S for success, time_s in rows])


def value_in(cell: Path, name: str) -> float:
    """What the setting was in that run, told or not; or how many states its policy has."""
    if name == STATES:
        return float(len(json.loads((cell / "policy.json").read_text())["states"]))
    inner: object = overlay(RunConfig(), {k: v for k, v in read_toml(cell / "run.toml").items() if k != "run"})
    for part in name.split("."):
        inner = getattr(inner, part)
    return float(inner)  # type: ignore[arg-type]


def axes_of(folder: Path, late: int = 0) -> dict[str, Points]:
    """The settings that were varied, one at a time."""
    told = {cell.parent: json.loads(cell.read_text())["fields"] for cell in sorted(folder.glob("cells/*/cell.json"))}
    cells = {
        cell: {STATES if name.startswith("perception.") else name for name in fields} for cell, fields in told.items()
    }
    axes: dict[str, Points] = {name: defaultdict(list) for fields in cells.values() for name in fields}
    for cell, fields in cells.items():
        times = times_of(cell)
        settled = len(times) - late if late else 10
        for name in fields if len(fields) == 1 else () if fields else axes:
            axes[name][value_in(cell, name)].append((converged(times, settled), float(times[settled:].mean())))
    return axes


def law(points: Points, column: int) -> tuple[float, float, float, float]:
    """Factor and exponent, and the interval of the exponent."""
    values = sorted(points)
    seeds = min(len(points[value]) for value in values)
    logs = np.log([[points[value][seed][column] for value in values] for seed in range(seeds)])
    at = np.log(values)

    def exponent(*drawn: np.ndarray, axis: int = -1) -> np.ndarray:
        means = np.stack([np.mean(each, axis=axis) for each in drawn])
        slope: np.ndarray = np.tensordot(at - at.mean(), means, axes=1) / ((at - at.mean()) ** 2).sum()
        return slope

    fit = linregress(np.tile(at, seeds), logs.ravel())
    found = bootstrap(tuple(logs.T), exponent, paired=True, vectorized=True, method="percentile", n_resamples=5000,
                      rng=np.random.default_rng(0))  # fmt: skip
    return float(np.exp(fit.intercept)), float(fit.slope), *map(float, found.confidence_interval)


def fitted(form: str, x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """The law's a and b, by least squares of the relative error; of a power, of its logarithm."""
    if form == POWER:
        line = linregress(np.log(x), np.log(y))
        return float(np.exp(line.intercept)), float(line.slope)
    columns = np.stack((np.ones_like(x), FORMS[form](x)), axis=1)
    a, b = np.linalg.lstsq(columns / y[:, None], np.ones_like(y), rcond=None)[0]
    return float(a), float(b)


def foretold(form: str, law: tuple[float, float], x: np.ndarray) -> np.ndarray:
    a, b = law
    return np.asarray(a * x**b if form == POWER else a + b * FORMS[form](x))


def left_out(points: Points, column: int) -> list[tuple[float, str, float, float]]:
    """Of each form of law, the best first: by what share it misses a value that it was not fitted to, form, a and b.

    Every value is left out once, with all its seeds; the share is the root mean square of the logarithm, as a factor
    less 1. A law that comes to nothing there counts as a tenth of the least that was found.
    """
    x = np.array([value for value, seeds in sorted(points.items()) for _ in seeds])
    y = np.array([seed[column] for _, seeds in sorted(points.items()) for seed in seeds])
    rows = []
    for form in (POWER, *FORMS):
        misses = np.zeros_like(x)
        for value in points:
            out = x == value
            there = foretold(form, fitted(form, x[~out], y[~out]), x[out])
            misses[out] = np.log(np.maximum(there, 0.1 * y.min()) / y[out])
        rows.append((float(np.expm1(np.sqrt(np.square(misses).mean()))), form, *fitted(form, x, y)))
    return sorted(rows)


def interval(values: list[float]) -> str:
    """Mean, least and most: of a few seeds no more can be said."""
    return f"{np.mean(values):.3g} ({min(values):.3g} to {max(values):.3g})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", type=Path)
    parser.add_argument("--late", type=int, default=0)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    axes = axes_of(options.study, options.late)
    for name, points in axes.items():
        print(f"| `{name}` | seeds | trials to convergence | late trials, s |\n|---|---|---|---|")
        for value, seeds in sorted(points.items()):
            print(f"| {value:g} | {len(seeds)} | " + " | ".join(interval([s[i] for s in seeds]) for i in (0, 1)) + " |")
        for column, what in ((0, "trials"), (1, "late s")):
            factor, exponent, low, high = law(points, column)
            print(f"\n{what}: missed where left out, form, a, b")
            for missed, form, a, b in left_out(points, column):
                print(f"  {missed:5.0%}  {form:12s} {a:8.3g} {b:8.3g}")
            print(f"{what} = {factor:.3g} x value ^ {exponent:.2f}, exponent {low:.2f} to {high:.2f} at 95 %")
        print()
    if options.out:
        draw(axes, options.out)


def draw(axes: dict[str, Points], out: Path) -> None:
    mpl.use("svg")
    mpl.rcParams["svg.hashsalt"] = "palpate"
    from matplotlib import pyplot as plt

    figure, grid = plt.subplots(2, len(axes), figsize=(3.6 * len(axes), 5.6), sharey="row", squeeze=False)
    for number, (name, points) in enumerate(axes.items()):
        values = np.array(sorted(points))
        for column, what in enumerate(SHOWN):
            axis = grid[column, number]
            axis.loglog(*np.array([(v, s[column]) for v in values for s in points[v]]).T, "o", ms=4, alpha=0.5)
            factor, exponent, low, high = law(points, column)
            told = f"exponent {exponent:.2f} ({low:.2f} to {high:.2f})"
            axis.loglog(values, factor * values**exponent, label=told)
            _, form, a, b = left_out(points, column)[0]
            between = np.geomspace(values[0], values[-1], 50)
            axis.loglog(between, foretold(form, (a, b), between), "--", label=form)
            axis.set_xticks(values, [f"{value:g}" for value in values], minor=False)
            axis.minorticks_off()
            low, high = axis.get_ylim()
            axis.set_yticks(ticks := [tick for tick in TICKS if low <= tick <= high], [f"{tick:g}" for tick in ticks])
            axis.legend(fontsize=8)
            axis.set_ylabel(what if number == 0 else "")
            axis.set_xlabel(name if column else "")
    figure.tight_layout()
    figure.savefig(out, metadata={"Date": None})


if __name__ == "__main__":
    main()
