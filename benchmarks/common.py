"""Common parts of the benchmarks: arguments, resumable sweeps, scored trials in the simulated cell, and tables."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from typing import Any, Final, NamedTuple, Self

import numpy as np

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import (
    Run,
    ScoredTrial,
    build_perception,
    exact_interval,
    learning_policy,
    true_hole_m,
)
from palpate.adapters.experiments import Trials as PolicyTrials
from palpate.core.control_loop import LoopObserver
from palpate.core.perception import Perception
from palpate.core.policy import Policy

FAILED_S: Final = 20.0
"""Time assigned to a failed trial: the time limit of an exploration."""
QUICK_STEPS: Final = {"task": {"ticks_per_action": 7, "motion_duty": 0.8}, "perception": {"cutoff_Hz": 7.0}}
"""Settings with actions of 50 ms, for baselines that step across the plate."""
Cell = dict[str, Any]
Hole = Callable[[], Sequence[float]]
Make = Callable[[RunConfig, Perception, Hole], Policy]
"""Function that makes a policy from settings, perception and the true position of the hole, which oracles need."""


class Row(NamedTuple):
    """Result of one trial, with the exploration time in seconds."""

    time_s: float
    success: bool
    outcome: str
    peak_N: float


class Trials:
    """Scored trials of one policy in the simulated cell, as a context manager.

    Args:
        config: Settings of the run.
        make: Function that makes the policy. Default: the learner in the settings.
        perception: Perception of the policy. Default: according to the settings.
    """

    def __init__(self, config: RunConfig, make: Make | None = None, perception: Perception | None = None) -> None:
        self.config, self._run, self._make = config, Run(config), learner if make is None else make
        self.perception = build_perception(config) if perception is None else perception

    def __enter__(self) -> Self:
        self.rig = self._run.__enter__().rig
        self.policy = self._make(self.config, self.perception, lambda: true_hole_m(self.rig))
        self._trials = PolicyTrials(self.config, self._run.ready, self.rig, self.perception, self.policy)
        return self

    def __exit__(self, *error: Any) -> None:
        self._run.__exit__(*error)

    def scored(self, number: int, watching: Sequence[LoopObserver] = ()) -> tuple[Row, ScoredTrial]:
        scored = self._trials.run(number, tuple(watching))
        time_s = round(scored.report.exploration_time_s, 4) if scored.success else FAILED_S
        outcome = "" if scored.report.outcome is None else scored.report.outcome.value
        peak_N = 0.0 if scored.truth is None else round(scored.truth.peak_force_N, 2)
        return Row(time_s, scored.success, outcome, peak_N), scored

    def run(self, numbers: Iterable[int]) -> list[Row]:
        return [self.scored(number)[0] for number in numbers]


def learner(config: RunConfig, perception: Perception, hole: Hole) -> Policy:
    """Return the untrained learner that the settings specify."""
    return learning_policy(config, perception)


def parser_of(text: str | None, *, seeds: int, first_seed: int, trials: int) -> argparse.ArgumentParser:
    """Return a parser with the options that all sweeps share."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=seeds, help="number of seeds")
    parser.add_argument("--first-seed", type=int, default=first_seed)
    parser.add_argument("--trials", type=int, default=trials)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--out", type=Path, help="file for a line of JSON per cell; what it has is not run again")
    return parser


def seeds_of(options: argparse.Namespace) -> range:
    return range(options.first_seed, options.first_seed + options.seeds)


def sweep(
    options: argparse.Namespace, run: Callable[[Cell], dict[str, Any]], cells: Sequence[Cell]
) -> list[tuple[Cell, dict[str, Any]]]:
    """Run the cells that are missing in ``--out``, in ``--jobs`` processes.

    Args:
        run: Function that returns the result of a cell, as JSON values.
        cells: Plain JSON values that identify a cell, in the order of execution.

    Returns:
        Each cell with its result, in the order of the cells.
    """
    path: Path | None = options.out
    done = _lines_of(path) if path is not None and path.exists() else {}
    waiting = [cell for cell in cells if _key(cell) not in done]
    with ExitStack() as stack:
        mapped: Callable[..., Iterable[tuple[Cell, dict[str, Any]]]] = map
        if options.jobs > 1:
            mapped = stack.enter_context(Pool(options.jobs)).imap_unordered
        for cell, found in mapped(partial(_one, run), waiting):
            done[_key(cell)] = found
            if path is not None:
                path.parent.mkdir(parents=True, exist_ok=True)
                with path.open("a", encoding="utf-8") as file:
                    file.write(json.dumps({"cell": cell, "found": found}) + "\n")
    return [(cell, done[_key(cell)]) for cell in cells]


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table, with two decimal places for floats."""
    lines = [" | ".join(head), "|".join(["---"] * len(head))]
    lines += [" | ".join(f"{cell:.2f}" if isinstance(cell, float) else str(cell) for cell in row) for row in rows]
    return "\n".join(f"| {line} |" if number != 1 else f"|{line}|" for number, line in enumerate(lines))


def share(good: int, count: int) -> str:
    """Return a success rate with its 95 % confidence interval."""
    low, high = exact_interval(good, count)
    return f"{good} of {count} ({100 * low:.1f} to {100 * high:.1f} %)"


def converged(times_s: np.ndarray, settled: int = 10) -> int:
    """Return the first trial (from 1) at which the mean of ten is within 20 % of the mean after ``settled`` trials."""
    late_s = times_s[settled:].mean()
    for first in range(len(times_s) - 10):
        if abs(times_s[first : first + 10].mean() - late_s) <= 0.2 * late_s:
            return first + 1
    return len(times_s)


def _one(run: Callable[[Cell], dict[str, Any]], cell: Cell) -> tuple[Cell, dict[str, Any]]:
    return cell, run(cell)


def _key(cell: Cell) -> str:
    return json.dumps(cell, sort_keys=True)


def _lines_of(path: Path) -> dict[str, dict[str, Any]]:
    """Return the results in a file by cell, and remove an incomplete last line from the file."""
    text = path.read_text(encoding="utf-8")
    whole, end, _ = text.rpartition("\n")
    path.write_text(whole + end, encoding="utf-8")
    lines = [json.loads(line) for line in whole.splitlines()]
    return {_key(line["cell"]): line["found"] for line in lines}
