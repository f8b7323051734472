"""The learner `memory` in the insertion task: what the paper's symbols are worth to a model of hidden states.

    python -m benchmarks.blind_memory --seeds 600 601 602 --trials 150
    python -m benchmarks.blind_memory --kind clones --position-mm 1

The same trials as those of `palpate train --learner memory --scenario blind`, in parts of fifty. Within --position-mm
of the believed place along x and y the torque is read, elsewhere the place: 1 as in the paper, 50 as in the scenario.
"""

import argparse
from time import process_time

import numpy as np

from palpate.adapters.config.run import scenario
from palpate.adapters.config.toml import overlay
from palpate.adapters.experiments.build import build_perception, build_task
from palpate.adapters.experiments.policies import learning_policy
from palpate.adapters.experiments.trial import run_scored_trial
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.policy.memory import AUTOMATON, CLONES, OFFSET
from palpate.core.trial import find_ready_pose

LAST = 50


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", nargs="+", type=int, default=[600])
    parser.add_argument("--trials", type=int, default=150)
    parser.add_argument("--kind", choices=(OFFSET, CLONES, AUTOMATON), default=OFFSET)
    parser.add_argument("--position-mm", type=float, default=50.0)
    options = parser.parse_args()
    for seed in options.seeds:
        chosen = {"seed": seed, "learning": {"memory": {"kind": options.kind}}}
        chosen["perception"] = {"position_threshold_mm": options.position_mm}
        config, began = overlay(scenario("blind", "memory"), chosen), process_time()
        ready, perception = find_ready_pose(config.arm, config.task), build_perception(config)
        task = build_task(config, ready, perception, learning_policy(config, perception))
        with SimulatedRig(config, ready) as rig:
            scored = [run_scored_trial(config, rig, task, trial) for trial in range(options.trials)]
        parts = [(first, scored[first : first + LAST]) for first in range(0, options.trials, LAST)]
        told = "; ".join(
            f"from {first} {np.median([one.report.exploration_time_s for one in part]):.2f} s,"
            f" {np.mean([one.success for one in part]):.0%}"
            for first, part in parts
        )
        print(f"{options.kind}, {options.position_mm:g} mm, seed {seed}: {told}; {process_time() - began:.0f} CPU s",
              flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
