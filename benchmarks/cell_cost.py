"""What physics costs in the cell as it comes, beside the cell as it was: whole trials, interleaved in one process.

    python -m benchmarks.cell_cost --trials 20

Three cells run the same trials of the torque rule, trial by trial in turn: as it was; the same with listed contacts,
which must move equally to the bit; and as it comes, whose trials go other ways. Times are processor time of the thread
inside ``WorkCell.advance``, a control tick; ratios have 95 % bootstrap intervals over trials.
"""

from __future__ import annotations

import argparse
import hashlib
from dataclasses import replace
from time import thread_time_ns

import numpy as np

from benchmarks.cell_learning import as_it_was
from benchmarks.tick_turns import ratio
from palpate.adapters.config.run import RunConfig, scenario
from palpate.adapters.experiments.build import build_perception, build_task
from palpate.adapters.experiments.policies import comparator
from palpate.adapters.experiments.trial import run_scored_trial
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.trial import find_ready_pose

SEED = 700


class Runner:
    """Trials of the torque rule in one cell.

    Attributes:
        digest: Of every joint angle and wrench after every tick so far.
        us: Microseconds of physics a tick, trial by trial.
        steps: Physics steps so far.
        inserted: Successes.
    """

    def __init__(self, config: RunConfig) -> None:
        self._config = config
        ready, perception = find_ready_pose(config.arm, config.task), build_perception(config)
        self._rig = rig = SimulatedRig(config, ready)
        rig.__enter__()
        policy = comparator("torque", config, lambda: rig.truth().hole_in_task_m)
        self._task = build_task(config, ready, perception, policy)
        self._plain = rig.cell.advance
        rig.cell.advance = self._advance  # type: ignore[method-assign]
        self.digest, self.us, self.steps, self.inserted = hashlib.sha256(), list[float](), 0, 0
        self._spent_ns = 0

    def _advance(self) -> None:
        began = thread_time_ns()
        self._plain()
        self._spent_ns += thread_time_ns() - began
        data = self._rig.cell.data
        self.digest.update(data.qpos.tobytes() + data.sensordata[:6].tobytes())

    def trial(self, index: int) -> None:
        ticks, self._spent_ns = self._rig.cell.ticks, 0
        self.inserted += run_scored_trial(self._config, self._rig, self._task, index).success
        ticks = self._rig.cell.ticks - ticks
        self.us.append(self._spent_ns * 1e-3 / ticks)
        self.steps += ticks * self._config.cell.substeps


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=20)
    trials = parser.parse_args().trials
    for name in ("paper", "blind"):
        new = replace(scenario(name), seed=SEED)
        old = replace(new, cell=as_it_was(new.cell))
        listed = replace(old, cell=replace(old.cell, contacts="listed"))
        runners = {"as it was": Runner(old), "listed": Runner(listed), "as it comes": Runner(new)}
        for index in range(trials):
            for runner in runners.values():
                runner.trial(index)
        first = runners["as it was"]
        for label, runner in runners.items():
            same = "equal to the bit" if runner.digest.digest() == first.digest.digest() else "another motion"
            us = np.array(runner.us)
            print(
                f"{name}, {label}: {us.mean():.1f} us a tick, over that as it was {ratio(us, np.array(first.us))};"
                f" {same}; {runner.steps} steps, {runner.inserted} of {trials} inserted",
                flush=True,
            )


if __name__ == "__main__":
    main()
