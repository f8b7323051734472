"""The learners on hidden states in the insertion task: what the paper's symbols are worth to a model of the offset.

    python -m benchmarks.blind_memory --seeds 600 601 602 --trials 150
    python -m benchmarks.blind_memory --kind clones --position-mm 1

Trials begin anywhere in `blind`; the learner reads the 17 symbols and knows what it did, no more. The eight actions are
0.7 mm long in each direction, which is on no lattice, for along a diagonal that is 0.495 mm each way: the offset
model is told 3 and 2 steps of 0.233 mm, 6 % too little. Within --position-mm of the believed place along x and y the
torque is read, elsewhere the place: 1 as in the paper, 50 as in the scenario, which tells the torque everywhere.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from time import process_time

import numpy as np

from palpate.adapters.config.run import RunConfig, scenario
from palpate.adapters.experiments.build import build_perception, build_task, task_actions
from palpate.adapters.experiments.trial import run_scored_trial
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.policy import Action, Decision, MemoryLearner, MemoryParameters, Observation
from palpate.core.policy.memory import CLONES, OFFSET
from palpate.core.trial import find_ready_pose
from palpate.simulation.grid import grid_actions

STEP_MM, LAST = 0.7 / 3, 50


class OnTheLattice(MemoryLearner):
    """Is told displacements that are on a lattice, and moves by the true ones."""

    def __init__(self, symbols: tuple[str, ...], actions: tuple[Action, ...], parameters: MemoryParameters) -> None:
        super().__init__(symbols, grid_actions(), parameters)
        self._true = actions
        self._steps = tuple(
            (round(x * 1e3 / STEP_MM), round(y * 1e3 / STEP_MM)) for x, y in (one.displacement_m for one in actions)
        )

    def choose(self, observation: Observation) -> Decision:
        """The action that the plan takes."""
        decision = super().choose(observation)
        return replace(decision, action=self._true[decision.index])


def one_seed(config: RunConfig, kind: str, trials: int) -> tuple[np.ndarray, np.ndarray]:
    """Exploration times and successes."""
    ready, perception = find_ready_pose(config.arm, config.task), build_perception(config)
    reach = round(2.0 * config.task.area_half_width_mm / STEP_MM)
    parameters = MemoryParameters(kind=kind, reach=min(reach, 20))
    learner = OnTheLattice(perception.symbols, tuple(task_actions(config)), parameters)
    task = build_task(config, ready, perception, learner)
    with SimulatedRig(config, ready) as rig:
        scored = [run_scored_trial(config, rig, task, trial) for trial in range(trials)]
    return np.array([one.report.exploration_time_s for one in scored]), np.array([one.success for one in scored])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", nargs="+", type=int, default=[600])
    parser.add_argument("--trials", type=int, default=150)
    parser.add_argument("--kind", choices=(OFFSET, CLONES), default=OFFSET)
    parser.add_argument("--position-mm", type=float, default=50.0)
    options = parser.parse_args()
    for seed in options.seeds:
        config = replace(scenario("blind"), seed=seed)
        config = replace(config, perception=replace(config.perception, position_threshold_mm=options.position_mm))
        began = process_time()
        times, wins = one_seed(config, options.kind, options.trials)
        parts = [(first, slice(first, first + LAST)) for first in range(0, options.trials, LAST)]
        told = "; ".join(f"from {k} {np.median(times[part]):.2f} s, {wins[part].mean():.0%}" for k, part in parts)
        print(f"{options.kind}, {options.position_mm:g} mm, seed {seed}: {told}; {process_time() - began:.0f} CPU s",
              flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
