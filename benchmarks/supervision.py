"""What the supervisor costs in a tick, over the snapshots of whole trials in the simulated cell.

    python -m benchmarks.supervision --trials 3 --rounds 20

The trials run once; then the same snapshots, commands and expectations go through the supervisor again and again. The
rest of the tick is timed in the same rounds, so that the ratio does not depend on the machine's mood.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.adapters.config.run import scenario
from palpate.adapters.experiments.build import build_perception, build_supervisor, build_task
from palpate.adapters.experiments.policies import comparator
from palpate.adapters.experiments.trial import trial_setup
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.control_loop import run_trial
from palpate.core.supervision.supervisor import Supervisor
from palpate.core.trial import Supervised, find_ready_pose

Heard = list[tuple[Any, ...]]


def overheard(supervisor: Supervisor) -> Heard:
    """What it is asked from now on."""
    heard: Heard = []
    check = supervisor.check

    def listening(*asked: Any) -> Supervised:
        heard.append(asked)
        return check(*asked)

    supervisor.check = listening  # type: ignore[method-assign]
    return heard


@dataclass(frozen=True)
class Found:
    """Microseconds a tick, one number a round.

    Attributes:
        ticks: Ticks of a round.
        checks_us: The supervisor.
        steps_us: The task's own step.
    """

    ticks: int
    checks_us: np.ndarray
    steps_us: np.ndarray


def measured(trials: int, rounds: int) -> Found:
    config = scenario("paper")
    ready, perception = find_ready_pose(config.arm, config.task), build_perception(config)
    task = build_task(config, ready, perception, comparator("torque", config, tuple))
    overheard_trials = []
    with SimulatedRig(config, ready) as rig:
        for trial in range(trials):
            rig.prepare(trial)
            supervisor = build_supervisor(config, ready, rig.sensor_facts)
            overheard_trials.append(overheard(supervisor))
            run_trial(task, rig.ports, trial_setup(config, trial), supervisor)
    ticks = sum(map(len, overheard_trials))
    checks, steps = [], []
    for _ in range(rounds):
        spent = thought = 0
        for number, heard in enumerate(overheard_trials):
            supervisor = build_supervisor(config, ready, rig.sensor_facts)
            supervisor.begin()
            begin = time.perf_counter_ns()
            for seen in heard:
                supervisor.check(*seen)
            spent += time.perf_counter_ns() - begin
            task.begin(trial_setup(config, number))
            begin = time.perf_counter_ns()
            for snapshot, *_ in heard:
                task.step(snapshot)
            thought += time.perf_counter_ns() - begin
        checks.append(spent * 1e-3 / ticks)
        steps.append(thought * 1e-3 / ticks)
    return Found(ticks, np.array(checks), np.array(steps))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=3)
    parser.add_argument("--rounds", type=int, default=20)
    options = parser.parse_args()
    found = measured(options.trials, options.rounds)
    print(
        f"supervisor: {found.checks_us.min():.2f} us a tick at best, {np.median(found.checks_us):.2f} at the median of"
        f" {options.rounds} rounds, {found.ticks} ticks"
    )
    print(f"the task's own step: {found.steps_us.min():.2f} and {np.median(found.steps_us):.2f} us")
    print(f"ratio: {np.median(found.checks_us / found.steps_us):.3f}")


if __name__ == "__main__":
    main()
