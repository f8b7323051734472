"""One touch model on many arms: what the belief learner made of ten trials on the Zebra Zero, frozen, on the others.

    python -m benchmarks.arms --trials 100 --jobs 2 --out arms

``--out`` is a folder: the policy of ``palpate train`` goes there, and one line for each block of ten trials as soon as
it is there; a second call goes on where the first was ended. Times are seconds of exploration; a failure counts 20.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from dataclasses import replace
from operator import itemgetter
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.seeds import gone_on_with
from palpate.adapters.config import scenario
from palpate.adapters.experiments import build_task, loaded_policy, perception_of, run_scored_trial
from palpate.adapters.experiments.evaluation import FIRST_EVALUATION_TRIAL
from palpate.adapters.experiments.statistics import wilson_interval
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.motion import Kinematics, ToolGeometry, arm_named
from palpate.core.motion.arm import ARMS
from palpate.core.policy import PolicyDocument
from palpate.core.trial import find_ready_pose

BLOCK: Final = 10
FAILED_S: Final = 20.0
TRAINED_TRIALS: Final = 10


def run(job: tuple[Path, str, str, int, int]) -> dict[str, Any]:
    """One block of trials of an arm in a scenario: times, successes, outcomes, true peak forces."""
    policy_file, name, arm, seed, block = job
    config = replace(scenario(name, "belief"), arm=arm, seed=seed)
    document = PolicyDocument.load(policy_file)
    ready, perception = find_ready_pose(config.arm, config.task), perception_of(document, config, None)
    policy = loaded_policy(document, config, perception, frozen=True)
    rows = []
    with SimulatedRig(config, ready) as rig:
        task = build_task(config, ready, perception, policy)
        first = FIRST_EVALUATION_TRIAL + block * BLOCK
        for trial in range(first, first + BLOCK):
            scored = run_scored_trial(config, rig, task, trial)
            time_s = round(scored.report.exploration_time_s, 4) if scored.success else FAILED_S
            outcome = scored.report.outcome
            rows.append((time_s, scored.success, outcome and outcome.value, round(rig.truth().peak_force_N, 2)))
    return {"scenario": name, "arm": arm, "seed": seed, "block": block, "trials": rows}


def train(out: Path, name: str, seed: int) -> Path:
    """The policy of ten trials on the Zebra Zero in a scenario; trained once."""
    folder = out / f"trained-{name}-{seed}"
    if not (folder / "policy.json").exists():
        words = ("train", "--learner", "belief", "--scenario", name, "--trials", TRAINED_TRIALS, "--seed", seed)
        call = [sys.executable, "-m", "palpate.adapters.cli.main", *map(str, words), "--out", str(folder)]
        subprocess.run(call, check=True)
    return folder / "policy.json"


def line(name: str, arm: str, trials: list[Any]) -> str:
    """A row of the table."""
    times, wins = np.array([trial[0] for trial in trials]), [bool(trial[1]) for trial in trials]
    low, high = wilson_interval(sum(wins), len(wins))
    joints = Kinematics(arm_named(arm), ToolGeometry()).joints
    cells = (
        name, arm, str(joints), f"{sum(wins)} of {len(wins)} ({100 * low:.1f} to {100 * high:.1f} %)",
        f"{np.median(times):.2f}", f"{times.mean():.2f}", f"{np.quantile(times, 0.95):.2f}",
        f"{max(trial[3] for trial in trials):.1f}",
    )  # fmt: skip
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arms", nargs="+", default=tuple(ARMS), choices=tuple(ARMS))
    parser.add_argument("--scenarios", nargs="+", default=("blind", "paper"))
    parser.add_argument("--train-seed", type=int, default=2200)
    parser.add_argument("--seed", type=int, default=2201)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    lines = options.out / "arms.jsonl"
    policies = {name: train(options.out, name, options.train_seed) for name in options.scenarios}
    # Blocks first: an early end leaves some of each arm.
    jobs = {
        (name, arm, options.seed, block): (policies[name], name, arm, options.seed, block)
        for block in range(-(-options.trials // BLOCK))
        for name in options.scenarios
        for arm in options.arms
    }
    done = gone_on_with(lines, options.jobs, run, jobs, itemgetter("scenario", "arm", "seed", "block"))
    print("| scenario | arm | joints | inserted | median s | mean s | p95 s | highest true force, N |")
    print("|---" * 8 + "|")
    for name in options.scenarios:
        for arm in options.arms:
            blocks = [b for b in done if (b["scenario"], b["arm"], b["seed"]) == (name, arm, options.seed)]
            if blocks:
                print(line(name, arm, [trial for block in blocks for trial in block["trials"]]))


if __name__ == "__main__":
    main()
