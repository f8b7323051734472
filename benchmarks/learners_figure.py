"""Exploration times of the two kinds of learners in ``paper``, in one picture: docs/images/learners.png.

    python -m benchmarks.learners_figure TABLE/learning.csv belief.jsonl docs/images/learners.png

The first file is of ``benchmarks/learning.py --out TABLE``, the second of ``benchmarks/belief.py --out belief.jsonl``.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

WINDOW = 5


def rolling(times: np.ndarray) -> np.ndarray:
    """Median over seeds of the mean of up to five trials round each one."""
    half = WINDOW // 2
    means = [times[:, max(k - half, 0) : k + half + 1].mean(axis=1) for k in range(times.shape[1])]
    return np.median(np.array(means), axis=1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", type=Path)
    parser.add_argument("belief", type=Path)
    parser.add_argument("picture", type=Path)
    options = parser.parse_args()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    table = np.loadtxt(options.table, delimiter=",", skiprows=1)[:, 1:].T
    seeds = [json.loads(line) for line in options.belief.read_text().splitlines()]
    figure = Figure(figsize=(8.0, 4.2), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.plot(1 + np.arange(table.shape[1]), rolling(table), color="#4878a8", label="table of 17 states, paper")
    for condition, colour in (("paper", "#d55e00"), ("blind", "#009e73"), ("blind-tilt-4", "#aa4499")):
        times = np.array([[t[0] for t in seed["trials"]] for seed in seeds if seed["condition"] == condition])
        axes.plot(1 + np.arange(times.shape[1]), rolling(times), color=colour, label=f"belief, {condition}")
    axes.set(xscale="log", yscale="log", xlabel="trial", ylabel="exploration time [s]")
    axes.set_yticks([0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0], ["0.2", "0.5", "1", "2", "5", "10", "20"])
    axes.set_xticks([1, 2, 5, 10, 20, 50, 100, 200, 350], ["1", "2", "5", "10", "20", "50", "100", "200", "350"])
    axes.minorticks_off()
    axes.grid(alpha=0.25)
    axes.legend(frameon=False)
    figure.savefig(options.picture, metadata={"Software": None})


if __name__ == "__main__":
    main()
