"""The cell as it comes beside the cell as it was: learning, comparators, capture, seed by seed.

    python -m benchmarks.cell_learning --seeds 20 --out FILE     goes on where FILE ends
    python -m benchmarks.cell_learning --out FILE --report       only prints what FILE holds
    python -m benchmarks.cell_learning --trials 0 --out FILE     leaves learning out, which takes nearly all of the time

For each seed and cell: 350 trials of learning, 20 of the torque rule and of the omniscient strategy on the same starts,
and the capture half-width at four headings. Differences are between cells of one seed, with 95 % bootstrap intervals
over seeds. The seeds are 600, 601, ...
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.adapters.config.run import RunConfig, scenario
from palpate.adapters.experiments.build import build_perception, build_task
from palpate.adapters.experiments.policies import comparator, learning_policy
from palpate.adapters.experiments.trial import ScoredTrial, run_scored_trial
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.trial import find_ready_pose
from palpate.simulation.work_cell.config import CellConfig
from tests.integration.physics.bench import Bench, headings, quiet

FIRST_SEED, TRIALS, EVALUATED, BLOCK = 600, 350, 20, 25
COMPARED = ("torque", "omniscient")


def as_it_was(cell: CellConfig) -> CellConfig:
    """The same cell with the numbers, the substeps and the search for contacts of before."""
    return replace(cell, contacts="searched", substeps=5, peg=replace(cell.peg, outer_boxes=0, upper_spheres=0))


def trials(config: RunConfig, name: str, indices: range) -> Iterator[ScoredTrial]:
    """Trials of a comparator, or of a policy that learns."""
    ready, perception = find_ready_pose(config.arm, config.task), build_perception(config)
    with SimulatedRig(config, ready) as rig:
        policy = (
            comparator(name, config, lambda: rig.truth().hole_in_task_m)
            if name in COMPARED
            else learning_policy(config, perception)
        )
        task = build_task(config, ready, perception, policy)
        for index in indices:
            yield run_scored_trial(config, rig, task, index)


def figures(seed: int, cell: str, learning: int) -> dict[str, Any]:
    """What one cell gives at one seed, with so many trials of learning."""
    config = replace(scenario("paper"), seed=seed)
    plain = quiet()
    if cell == "old":
        config, plain = replace(config, cell=as_it_was(config.cell)), replace(plain, cell=as_it_was(plain.cell))
    learned = list(trials(config, "learning", range(learning)))
    found: dict[str, Any] = {
        "seed": seed,
        "cell": cell,
        "times_s": [round(each.report.exploration_time_s, 4) for each in learned],
        "successes": [each.success for each in learned],
    }
    for name in COMPARED:
        compared = list(trials(config, name, range(EVALUATED)))
        found[f"{name}_s"] = [round(each.report.exploration_time_s, 4) for each in compared]
        found[f"{name}_successes"] = sum(each.success for each in compared)
    with Bench(plain) as bench:
        # The seed turns the headings, so that seeds differ here, too.
        found["capture_um"] = [round(bench.capture_half_width_m(h + seed) * 1e6, 1) for h in headings(4)]
    return found


def report(lines: list[dict[str, Any]]) -> None:
    """The figures of both cells and their differences, over the seeds that both have."""
    by = {(line["seed"], line["cell"]): line for line in lines}
    seeds = sorted(seed for seed, cell in by if cell == "new" and (seed, "old") in by)
    print(f"{len(seeds)} seeds\n\n| figure | old | new | new - old, 95 % interval over seeds |\n|---|---|---|---|")
    learned = {
        f"mean time, trials {low + 1} to {low + BLOCK}, s": lambda line, low=low: np.mean(
            line["times_s"][low : low + BLOCK]
        )
        for low in (0, 75, 150, 225, TRIALS - BLOCK)
    } | {
        "success, all trials": lambda line: np.mean(line["successes"]),
        f"success, last {BLOCK}": lambda line: np.mean(line["successes"][-BLOCK:]),
    }
    rows = (learned if all(line["times_s"] for line in lines) else {}) | {
        "torque rule, mean time, s": lambda line: np.mean(line["torque_s"]),
        "torque rule, success": lambda line: line["torque_successes"] / EVALUATED,
        "omniscient, mean time, s": lambda line: np.mean(line["omniscient_s"]),
        "omniscient, success": lambda line: line["omniscient_successes"] / EVALUATED,
        "capture half-width, um": lambda line: np.mean(line["capture_um"]),
    }
    rng = np.random.default_rng(0)
    draws = rng.integers(len(seeds), size=(5000, len(seeds)))
    for name, of in rows.items():
        old, new = (np.array([of(by[seed, cell]) for seed in seeds]) for cell in ("old", "new"))
        low, high = np.quantile((new - old)[draws].mean(axis=1), [0.025, 0.975])
        shown = f"{np.mean(new - old):+.3f} ({low:+.3f} to {high:+.3f})"
        print(f"| {name} | {old.mean():.3f} | {new.mean():.3f} | {shown} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--trials", type=int, default=TRIALS, help="of learning")
    parser.add_argument("--report", action="store_true")
    options = parser.parse_args()
    lines = [json.loads(line) for line in options.out.read_text().splitlines()] if options.out.exists() else []
    done = {(line["seed"], line["cell"]) for line in lines}
    for seed in range(FIRST_SEED, FIRST_SEED + options.seeds) if not options.report else ():
        for cell in ("old", "new"):
            if (seed, cell) not in done:
                lines.append(figures(seed, cell, options.trials))
                with options.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(lines[-1]) + "\n")
    report(lines)


if __name__ == "__main__":
    main()
