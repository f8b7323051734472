"""What the framework costs: a run against bare ``mj_step``, the tick without physics, and start-up times.

    python -m benchmarks.cost            350 trials of the paper scenario (a few minutes)
    python -m benchmarks.cost --quick    40 trials

The floor: the same number of ``mj_step`` calls on the same scene in the same process, under the very servo commands
that the run sent (recorded as it went), so that floor and run do the same physics, contact by contact. Both are CPU
times, which other work on the machine disturbs less.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np

from palpate.adapters.config.run import scenario
from palpate.adapters.experiments.build import build_perception, build_task
from palpate.adapters.experiments.policies import learning_policy
from palpate.adapters.experiments.trial import run_scored_trial
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.policy import Observation
from palpate.core.ports.values import JointCommand, Snapshot
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.trial import find_ready_pose

RATE_HZ = 140


class Recorded:
    """Keeps the state at each reset and the servo commands of each tick, for the floor."""

    def __init__(self, rig: SimulatedRig) -> None:
        self.cell = rig.cell
        self.trials: list[tuple[np.ndarray, np.ndarray, list[tuple[np.ndarray, mujoco.MjModel]]]] = []
        self._reset, self._advance = rig.cell.reset, rig.cell.advance
        rig.cell.reset = self.reset  # type: ignore[method-assign]
        rig.cell.advance = self.advance  # type: ignore[method-assign]

    def reset(self, seed: int, trial: int) -> None:
        self._reset(seed, trial)
        self.trials.append((self.cell.data.qpos.copy(), self.cell.model.body_pos.copy(), []))

    def advance(self) -> None:
        command = self.cell.data.ctrl.copy()
        self._advance()
        self.trials[-1][2].append((command, self.cell.stepped))

    def bare_seconds(self, calls_per_tick: int) -> float:
        """Time of the same physics without anything else, with so many ``mj_step`` calls for the steps of a tick."""
        model, nstep = self.cell.model, self.cell.config.substeps
        data = mujoco.MjData(model)
        total = 0.0
        for qpos, body_pos, commands in self.trials:
            mujoco.mj_resetData(model, data)
            for each in self.cell.models:
                each.body_pos[:] = body_pos
            data.qpos[:] = qpos
            data.ctrl[:] = qpos[: len(data.ctrl)]
            mujoco.mj_forward(model, data)
            start = time.process_time()
            for command, stepped in commands:
                data.ctrl[:] = command
                for _ in range(calls_per_tick):
                    mujoco.mj_step(stepped, data, nstep // calls_per_tick)
            total += time.process_time() - start
        return total


@dataclass(frozen=True)
class Throughput:
    """CPU time of a training run and of its physics alone.

    Attributes:
        ticks: Control ticks.
        steps: Physics steps.
        run_s: The run.
        floor_s: The same number of ``mj_step`` calls, under the same commands.
        strict_s: The same with one call for all steps of a tick.
    """

    ticks: int
    steps: int
    run_s: float
    floor_s: float
    strict_s: float


def throughput(trials: int) -> Throughput:
    config = scenario("paper")
    ready, perception = find_ready_pose(config.arm, config.task), build_perception(config)
    plain = build_task(config, ready, perception, learning_policy(config, perception))
    with SimulatedRig(config, ready) as rig:
        start = time.process_time()
        ticks = sum(run_scored_trial(config, rig, plain, k).report.ticks for k in range(trials))
        seconds = time.process_time() - start
    # The same run once more (equal to the bit), now keeping the commands for the floor.
    task = build_task(config, ready, perception, learning_policy(config, perception))
    with SimulatedRig(config, ready) as rig:
        recorded = Recorded(rig)
        again = sum(run_scored_trial(config, rig, task, k).report.ticks for k in range(trials))
    if again != ticks:
        raise SystemExit(f"the two runs differ: {ticks} and {again} ticks")
    substeps = config.cell.substeps
    return Throughput(ticks, ticks * substeps, seconds, recorded.bare_seconds(substeps), recorded.bare_seconds(1))


def run_against_floor(trials: int) -> None:
    found = throughput(trials)
    simulated_s = found.ticks / RATE_HZ
    print(f"{trials} trials, {found.ticks} ticks, {simulated_s:.0f} s of simulated time, {found.steps} physics steps")
    ratio = found.run_s / found.floor_s
    print(f"run {found.run_s:.1f} s, bare mj_step {found.floor_s:.1f} s: ratio {ratio:.3f} (at most 1.25)")
    strict = found.run_s / found.strict_s
    print(f"stricter floor, one call for all steps of a tick: {found.strict_s:.1f} s, ratio {strict:.3f}")
    print(f"{simulated_s / found.run_s:.1f} times real time on one core (at least 20)")


class TimedTask(InsertionTask):
    """Times the core's share of each tick."""

    durations: list[float]

    def sense(self, snapshot: Snapshot) -> Observation | None:
        self._began = time.perf_counter()
        return super().sense(snapshot)

    def act(self) -> JointCommand:
        command = super().act()
        self.durations.append(time.perf_counter() - self._began)
        return command


def tick_us(trials: int) -> dict[str, np.ndarray]:
    """Microseconds of each tick between two stretches of physics, in all and of the core alone."""
    config = scenario("paper")
    ready, perception = find_ready_pose(config.arm, config.task), build_perception(config)
    task = build_task(config, ready, perception, learning_policy(config, perception))
    task.__class__ = TimedTask
    assert isinstance(task, TimedTask)
    task.durations = []
    whole: list[float] = []
    with SimulatedRig(config, ready) as rig:
        advance = rig.cell.advance
        marks: list[tuple[float, float]] = []

        def timed() -> None:
            begin = time.perf_counter()
            advance()
            marks.append((begin, time.perf_counter()))

        rig.cell.advance = timed  # type: ignore[method-assign]
        for k in range(trials):
            marks.clear()
            run_scored_trial(config, rig, task, k)
            # From the end of one physics tick to the begin of the next: read, filter, kinematics, symbols, command.
            whole += [b[0] - a[1] for a, b in pairwise(marks)]
    return {"whole tick (ports and core)": np.array(whole) * 1e6, "core alone": np.array(task.durations) * 1e6}


def tick_without_physics(trials: int) -> None:
    for name, us in tick_us(trials).items():
        median, high = np.quantile(us, [0.5, 0.999])
        print(f"{name}: median {median:.1f} us, 99.9th percentile {high:.1f} us over {len(us)} ticks")


def start_up_seconds(runs: int = 7) -> dict[str, float]:
    """Wall time of whole processes, medians."""
    import_core = "import palpate.core"
    import_all = "import palpate.core.control_loop, palpate.core.tasks.insertion.task, palpate.core.ports.contracts"
    help_call = [sys.executable, "-m", "palpate.adapters.cli.main"]
    calls = {
        "python -c pass": [sys.executable, "-c", "pass"],
        import_core: [sys.executable, "-c", import_core],
        "every module of the core": [sys.executable, "-c", import_all],
        "palpate --help": [*help_call, "--help"],
        "palpate train --help": [*help_call, "train", "--help"],
    }
    return {label: _median_seconds(call, runs) for label, call in calls.items()}


def start_up() -> None:
    for label, seconds in start_up_seconds().items():
        print(f"{label}: {seconds:.3f} s (whole process)")


def _median_seconds(command: list[str], runs: int) -> float:
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        times.append(time.perf_counter() - start)
    return float(np.median(times))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    quick = parser.parse_args().quick
    start_up()
    tick_without_physics(5 if quick else 20)
    run_against_floor(40 if quick else 350)
