"""Where the time of an insertion goes, by the events of recorded trials.

    python -m benchmarks.time_budget runs/belief [--from-trial 10]

Mean and 95th percentile over the trials that ended in the hole, in ms. "Actions" is exploration without first touch and
lifts; its floor is the way from the first touch to the hole at the speed of a longest step.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import pairwise
from math import dist
from pathlib import Path

import numpy as np

from palpate.adapters.log import TrialLog, read_log, series_of
from palpate.core.ports import CONTROL_RATE_HZ

SPEED_MM_S = 16.0


def parts(log: TrialLog) -> Iterator[tuple[str, float]]:
    """The parts of one trial and their times, in ms."""
    begins = [(event.tick, event.detail) for event in log.events if event.name == "phase"]
    end = next(event.tick for event in log.events if event.name == "end")
    spans: dict[str, int] = {}
    for (tick, name), (after, _) in zip(begins, [*begins[1:], (end, "")], strict=True):
        spans[name] = spans.get(name, 0) + after - tick
    explored = next(tick for tick, name in begins if name == "explore")
    touched = log.decisions[0].tick - explored if log.decisions else spans["explore"]
    series, chosen = series_of(log), [decision.tick for decision in log.decisions]
    # While a lift is made, the action's own time stands still.
    over = [
        after - tick - series.config.task.ticks_per_action
        for tick, after in pairwise([*chosen, explored + spans["explore"]])
    ]
    lifts = sum(max(ticks, 0) for ticks in over)
    for name in ("transfer", "settle", "approach"):
        yield name, spans.get(name, 0)
    yield "first touch", touched
    yield "lifts", lifts
    yield "actions", spans["explore"] - touched - lifts
    start = series.tip_mm[int(np.searchsorted(series.ticks, explored))]
    hole = log.end.true_hole_in_task_m if log.end is not None else ()
    if hole:
        yield (
            "floor of the actions",
            dist(start[:2], [1e3 * value for value in hole[:2]]) / SPEED_MM_S * CONTROL_RATE_HZ,
        )
    yield "going in", spans.get("insert", 0)
    yield "proof on the floor", spans.get("prove", 0)
    yield "whole trial", end


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--from-trial", type=int, default=10)
    options = parser.parse_args()
    table: dict[str, list[float]] = {}
    for folder in options.runs:
        for path in sorted(folder.glob("logs/*.mcap")):
            log = read_log(path)
            if log.start.trial < options.from_trial or log.end is None or log.end.outcome != "inserted":
                continue
            for name, ticks in parts(log):
                table.setdefault(name, []).append(1e3 * ticks / CONTROL_RATE_HZ)
    print("| part | mean, ms | 95th percentile, ms |\n|---|---|---|")
    for name, values in table.items():
        print(f"| {name} | {np.mean(values):.0f} | {np.quantile(values, 0.95):.0f} |")
    print(f"\n{len(table.get('whole trial', ()))} trials")


if __name__ == "__main__":
    main()
