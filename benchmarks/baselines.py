"""A table of rules, searches, learners and oracles, all on the same trials.

    palpate train --scenario paper --seed 7 --out runs/tabular
    palpate train --scenario paper --learner belief --trials 10 --seed 7 --out runs/belief
    python -m benchmarks.baselines --scenario paper --seed 640 --trials 50 --policies runs/tabular runs/belief

The policies are frozen, as stored in their folders. With ``--dqn 350``, an agent of Stable-Baselines3 is trained for
350 trials in the same cell, and the trial from which the mean of ten is at most 0.5 s is printed. This requires
``pip install -e '.[gymnasium]' -r examples/stable_baselines3/requirements.txt -c constraints.txt``.

Times are simulated. "Search" is the exploration time; a failure counts as 20 s. "Cycle" is the time from the first
contact to full depth, including contact verification on the way down, for trials that ended at full depth. The mean
force is the sensor reading in that time relative to its reading in free air; the peak force is the cell's ground truth.
"""

from __future__ import annotations

import argparse
import runpy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import FAILED_S, Make, Trials, table
from palpate.adapters.config import RunConfig, overlay, scenario
from palpate.adapters.experiments import baseline, load_policy, loaded_policy, task_actions
from palpate.adapters.experiments.baselines import Oracle
from palpate.core.control_loop import LoopObserver
from palpate.core.policy import Decision, FixedPolicy, Observation
from palpate.core.ports import CONTROL_RATE_HZ, WrenchSample

HEAD = ("policy", "success", "search s: mean, median, p95", "cycle s: mean, p95", "mean force N", "peak N: mean, most")


class Forces(LoopObserver):
    """Observer that records the measured force in each tick."""

    def __init__(self) -> None:
        self.forces_N: list[tuple[float, float, float]] = []

    def force_read(self, sample: WrenchSample) -> None:
        self.forces_N.append(sample.force_N)


class Agent(FixedPolicy):
    """A Stable-Baselines3 agent as a policy, whose input is the number of the state."""

    def __init__(self, model: Any, config: RunConfig) -> None:
        super().__init__()
        self._model, self._actions = model, task_actions(config)

    def choose(self, observation: Observation) -> Decision:
        index = int(self._model.predict(observation.state, deterministic=True)[0])
        return Decision(self._actions[index], index, "dqn")


def figures(name: str, config: RunConfig, make: Make, count: int) -> tuple[object, ...]:
    """Return a row of the table. Cycle and mean force are for the trials that ended at full depth."""
    cycles_s, means_N, rows = [], [], []
    with Trials(config, make) as trials:
        for number in range(count):
            seen = Forces()
            row, scored = trials.scored(number, watching=(seen,))
            rows.append(row)
            if row.success:
                begins = {event.detail: event.tick for event in scored.report.events if event.name == "phase"}
                forces_N, touched, seated = np.array(seen.forces_N), begins["explore"], begins["prove"]
                air_N = forces_N[begins["settle"] : begins["approach"]].mean(axis=0)
                cycles_s.append((seated - touched) / CONTROL_RATE_HZ)
                means_N.append(np.linalg.norm(forces_N[touched:seated] - air_N, axis=1).mean())
    search_s, peaks_N = np.array([row.time_s for row in rows]), np.array([row.peak_N for row in rows])
    cycle = f"{np.mean(cycles_s):.2f}, {np.percentile(cycles_s, 95):.2f}" if cycles_s else ""
    return (
        name, f"{sum(row.success for row in rows)} of {count}",
        f"{search_s.mean():.2f}, {np.median(search_s):.2f}, {np.percentile(search_s, 95):.2f}", cycle,
        f"{np.mean(means_N):.1f}" if means_N else "", f"{peaks_N.mean():.1f}, {peaks_N.max():.1f}",
    )  # fmt: skip


def of_file(folder: Path) -> Make:
    document = load_policy(folder / "policy.json")
    return lambda config, perception, _: loaded_policy(document, config, perception, frozen=True)


def oracle(speed_mm_s: float) -> Make:
    return lambda config, _, hole: Oracle(hole, speed_mm_s * 1e-3 * config.task.ticks_per_action / CONTROL_RATE_HZ)


def named(name: str) -> Make:
    return lambda config, _, hole: baseline(name, config, hole)


def trained_agent(seed: int, trials: int) -> Any:
    """Train the agent of the example for a number of trials, and print when its mean time fell to half a second."""
    example = runpy.run_path(str(Path(__file__).parents[1] / "examples" / "stable_baselines3" / "train.py"))
    curve, model = example["Curve"]("DQN"), example["dqn"](seed)
    while len(curve.trials) < trials:
        model.learn(100 * trials, callback=example["Trials"](curve, trials), reset_num_timesteps=False)
    times_s = np.where(curve.successes, curve.times_s, FAILED_S)
    means_s = np.convolve(times_s, np.full(10, 0.1), "valid")
    below = np.flatnonzero(means_s <= 0.5)
    print(f"DQN: {trials} trials; ten in a row take at most 0.5 s from trial {below[0] + 1 if below.size else 'none'};")
    print(f"least mean of ten {means_s.min():.2f} s, last 25 {times_s[-25:].mean():.2f} s", flush=True)
    return model


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", default="paper")
    parser.add_argument("--seed", type=int, default=640)
    parser.add_argument("--trials", type=int, default=50)
    parser.add_argument("--policies", type=Path, nargs=2, metavar=("TABULAR", "BELIEF"), required=True)
    parser.add_argument("--dqn", type=int, default=0, help="trials by which an agent of Stable-Baselines3 learns")
    options = parser.parse_args()
    paced = replace(scenario(options.scenario), seed=options.seed)
    sliding = replace(scenario(options.scenario, "belief"), seed=options.seed)
    paced_twice = {"task": {"ticks_per_action": 7, "motion_duty": 0.8}, "perception": {"cutoff_Hz": 7.0}}
    quick = overlay(sliding, paced_twice)
    tabular, belief = map(of_file, options.policies)
    cap_mm_s, travel_mm_s = sliding.learning.belief.speed_mm_s, sliding.task.travel_speed_mm_s
    chosen: list[tuple[str, RunConfig, Make]] = [
        (f"oracle, {travel_mm_s:g} mm/s, the limit of travel", sliding, oracle(travel_mm_s)),
        (f"oracle, {cap_mm_s:g} mm/s, the belief's speed", sliding, oracle(cap_mm_s)),
        ("oracle, 10 mm/s, the table's speed", paced, oracle(10.0)),
        ("belief, frozen", sliding, belief),
        ("torque rule, 50 ms and 7 Hz", quick, named("torque")),
        ("torque rule, 100 ms and 4 Hz", paced, named("torque")),
        ("table of 17 states, frozen", paced, tabular),
        ("spiral, 10 mm/s", paced, named("spiral-10")),
        ("spiral, 5 mm/s", paced, named("spiral-5")),
        ("random walk", paced, named("random")),
    ]
    if options.dqn:
        model = trained_agent(options.seed + 1, options.dqn)
        chosen.append(("DQN of Stable-Baselines3, frozen", paced, lambda config, *_: Agent(model, config)))
    print(table(HEAD, (figures(name, config, make, options.trials) for name, config, make in chosen)))


if __name__ == "__main__":
    main()
