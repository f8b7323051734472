"""palpate gap on a cell that differs (friction 0.35, stiffness x0.7, latency 20 ms): how far off what it finds is.

python -m benchmarks.gap --trials 8 --draws 3
"""

from __future__ import annotations

import argparse
import tempfile
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from palpate.adapters.config import scenario
from palpate.adapters.experiments import ChosenPolicy, Recorded, RunFolder, run_policy
from palpate.adapters.mujoco import SimulatedRig
from palpate.adapters.replay import Gap, find_logs, gap_of
from palpate.core.trial import find_ready_pose
from palpate.simulation.work_cell import HiddenValues

POLICY = "torque"
TRUE = {"friction": 0.35, "axial": 0.7, "across": 0.7, "latency_ms": 20.0}


def record(folder: Path, seed: int, trials: int) -> None:
    """Trials on that cell, in virtual time."""
    config = replace(scenario("paper"), seed=seed)
    ready, chosen = find_ready_pose(config.arm, config.task), ChosenPolicy(POLICY, config)
    other = HiddenValues(springs_share=0.7, friction=0.35, latency_ms=20.0)
    with ExitStack() as opened, SimulatedRig(config, ready, other) as rig:
        recorder = RunFolder(folder).recorder(config.recording, opened)
        recorded = Recorded(recorder, "run", POLICY)
        run_policy(config, ready, rig, chosen.perception, chosen.on(rig), trials, lambda _: None, recorded)


def found(gap: Gap) -> dict[str, float]:
    """The same of a fit."""
    friction, axial, across, *_ = gap.values.tolist()
    return {"friction": friction, "axial": axial, "across": across, "latency_ms": gap.wrench_late_ms}


def main() -> None:
    """Print what each draw finds, and its error."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=8)
    parser.add_argument("--draws", type=int, default=3)
    parser.add_argument("--first", type=int, default=100, help="seed of the first draw")
    options = parser.parse_args()
    for seed in range(options.first, options.first + options.draws):
        with tempfile.TemporaryDirectory() as folder:
            record(Path(folder), seed, options.trials)
            gap = gap_of(find_logs([folder]), lambda: None)
        for name, value in found(gap).items():
            away = 100.0 * (value / TRUE[name] - 1.0)
            print(
                f"{seed} {name}: {value:.4g}, {away:+.1f} % off: {'met' if abs(away) <= 10.0 else 'NOT MET'}",
                flush=True,
            )
        before, after = (f"{errors.wrench[2]:.3g}" for errors in (gap.before, gap.after))
        print(f"{seed} Fz: {before} N as configured, {after} N fitted", flush=True)


if __name__ == "__main__":
    main()
