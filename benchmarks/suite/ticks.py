"""Cost of a control tick: a run relative to its bare physics, a tick without physics, supervisor and recording."""

from __future__ import annotations

import tempfile
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from benchmarks.suite.figures import Form, Row
from palpate.adapters.config import scenario
from palpate.adapters.experiments import (
    baseline,
    build_perception,
    build_supervisor,
    build_task,
    learning_policy,
    ready_pose,
    run_scored_trial,
    trial_setup,
)
from palpate.adapters.log.sink import FileSink
from palpate.adapters.log.trial_recorder import TrialRecorder
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.control_loop import run_trial
from palpate.core.policy import Observation
from palpate.core.ports.values import CONTROL_RATE_HZ, JointCommand, Snapshot
from palpate.core.supervision.supervisor import Supervisor
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.trial import Supervised

CONFIG = scenario("paper")


class Recorded:
    """The state at each reset and the servo commands of each tick, for the bare physics of the same run."""

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
        contacts = self.cell.contacts
        stepped = self.cell.model if contacts is None else contacts.models[contacts.level]
        self.trials[-1][2].append((command, stepped))

    def bare_s(self, calls_per_tick: int) -> float:
        """CPU time of the same physics alone, in so many calls of ``mj_step`` a tick."""
        steps = self.cell.config.substeps // calls_per_tick
        data = mujoco.MjData(self.cell.model)
        total = 0.0
        for qpos, body_pos, commands in self.trials:
            mujoco.mj_resetData(self.cell.model, data)
            for each in self.cell.models:
                each.body_pos[:] = body_pos
            data.qpos[:] = qpos
            data.ctrl[:] = qpos[: len(data.ctrl)]
            mujoco.mj_forward(self.cell.model, data)
            began = time.process_time()
            for command, stepped in commands:
                data.ctrl[:] = command
                for _ in range(calls_per_tick):
                    mujoco.mj_step(stepped, data, steps)
            total += time.process_time() - began
        return total


def learning_task() -> Any:
    """A task that learns, from the beginning."""
    perception = build_perception(CONFIG)
    return build_task(CONFIG, ready_pose(CONFIG), perception, learning_policy(CONFIG, perception))


def simulated() -> SimulatedRig:
    return SimulatedRig(CONFIG, ready_pose(CONFIG))


def throughput(form: Form) -> list[Row]:
    """A training run, once to be timed and once, equal to the bit, to keep its commands."""
    task = learning_task()
    with simulated() as rig:
        began = time.process_time()
        ticks = sum(run_scored_trial(CONFIG, rig, task, k).report.ticks for k in range(form.trials))
        run_s = time.process_time() - began
    task = learning_task()
    with simulated() as rig:
        kept = Recorded(rig)
        if sum(run_scored_trial(CONFIG, rig, task, k).report.ticks for k in range(form.trials)) != ticks:
            raise RuntimeError("the two runs differ")
        same_s, single_s = kept.bare_s(CONFIG.cell.substeps), kept.bare_s(1)
    us = 1e6 / ticks
    return [
        Row("training run", run_s * us, "us a tick", "the same mj_step calls", same_s * us),
        Row("training run", run_s * us, "us a tick", "one mj_step call a tick", single_s * us),
        Row("times real time, one core", ticks / CONTROL_RATE_HZ / run_s, "(more is better)"),
    ]


class TimedTask(InsertionTask):
    """Times the core's share of each tick."""

    durations_us: list[float]

    def sense(self, snapshot: Snapshot) -> Observation | None:
        self._began = time.perf_counter()
        return super().sense(snapshot)

    def act(self) -> JointCommand:
        command = super().act()
        self.durations_us.append(1e6 * (time.perf_counter() - self._began))
        return command


class Marked:
    """When each stretch of physics began and ended."""

    def __init__(self, rig: SimulatedRig) -> None:
        self.marks: list[tuple[float, float]] = []
        self._advance = rig.cell.advance
        rig.cell.advance = self.advance  # type: ignore[method-assign]

    def advance(self) -> None:
        began = time.perf_counter()
        self._advance()
        self.marks.append((began, time.perf_counter()))

    def between_us(self) -> list[float]:
        """Read, filter, kinematics, symbols, command: from the end of physics to its next beginning."""
        return [1e6 * (after[0] - before[1]) for before, after in pairwise(self.marks)]


def tick(form: Form) -> list[Row]:
    """Each tick between two stretches of physics, in all and of the core alone."""
    task = learning_task()
    task.__class__ = TimedTask
    task.durations_us = []
    whole_us: list[float] = []
    with simulated() as rig:
        marked = Marked(rig)
        for trial in range(max(form.trials // 4, 4)):
            marked.marks.clear()
            run_scored_trial(CONFIG, rig, task, trial)
            whole_us += marked.between_us()
    rows = []
    for name, us in {"ports and core": whole_us, "core alone": task.durations_us}.items():
        rows.append(Row(f"{name}, median", float(np.median(us)), "us"))
        rows.append(Row(f"{name}, 99.9th percentile", float(np.quantile(us, 0.999)), "us"))
    return rows


def supervisor(form: Form) -> list[Row]:
    """The supervisor and the task's own step over the same snapshots, in turns."""
    ready, perception = ready_pose(CONFIG), build_perception(CONFIG)
    task = build_task(CONFIG, ready, perception, baseline("torque", CONFIG, tuple))
    trials = []
    with simulated() as rig:
        for trial in range(2):
            rig.prepare(trial)
            watching = build_supervisor(CONFIG, ready, rig.sensor_facts)
            trials.append(_calls_of(watching))
            run_trial(task, rig.ports, trial_setup(CONFIG, trial), watching)
    ticks = sum(map(len, trials))
    checks_us, steps_us = [], []
    for _ in range(form.rounds):
        checking_ns = stepping_ns = 0
        for number, calls in enumerate(trials):
            watching = build_supervisor(CONFIG, ready, rig.sensor_facts)
            watching.begin()
            began = time.perf_counter_ns()
            for call in calls:
                watching.check(*call)
            checking_ns += time.perf_counter_ns() - began
            task.begin(trial_setup(CONFIG, number))
            began = time.perf_counter_ns()
            for snapshot, *_ in calls:
                task.sense(snapshot)
                task.act()
            stepping_ns += time.perf_counter_ns() - began
        checks_us.append(checking_ns * 1e-3 / ticks)
        steps_us.append(stepping_ns * 1e-3 / ticks)
    return [Row("supervise", float(np.median(checks_us)), "us a tick", "the task's step", float(np.median(steps_us)))]


def _calls_of(watching: Supervisor) -> list[tuple[Any, ...]]:
    """What it is asked to check from now on."""
    calls: list[tuple[Any, ...]] = []
    check = watching.check

    def listening(*call: Any) -> Supervised:
        calls.append(call)
        return check(*call)

    watching.check = listening  # type: ignore[method-assign]
    return calls


class Trajectory:
    """One training, recorded or not, timed trial by trial."""

    def __init__(self, folder: Path | None) -> None:
        self.seconds, self.ticks_us = 0.0, list[float]()
        self.task, self.rig = learning_task(), simulated().__enter__()
        self.recorder: TrialRecorder | None = None
        if folder is not None:
            self.recorder = TrialRecorder(FileSink(), folder, CONFIG.recording).__enter__()
            ready, perception = ready_pose(CONFIG), build_perception(CONFIG)
            policy = learning_policy(CONFIG, perception)
            self.task = build_task(CONFIG, ready, perception, policy)
            self.recorder.of("bench", CONFIG, ready, self.task, perception, policy, frozen=False)
        self.marked = Marked(self.rig)

    def run(self, trial: int) -> int:
        self.marked.marks.clear()
        began = time.perf_counter()
        report = run_scored_trial(CONFIG, self.rig, self.task, trial, self.recorder).report
        self.seconds += time.perf_counter() - began
        self.ticks_us += self.marked.between_us()
        return report.ticks

    def close(self) -> None:
        began = time.perf_counter()
        if self.recorder is not None:
            self.recorder.__exit__()
            self.seconds += time.perf_counter() - began
        self.rig.__exit__(None, None, None)


def recording(form: Form) -> list[Row]:
    """The same trials with and without recording, in turns, so that a slower machine slows both."""
    with tempfile.TemporaryDirectory() as folder:
        courses = [Trajectory(None), Trajectory(Path(folder))]
        for trial in range(max(form.trials * 2 // 3, 4)):
            # Back and forth, so that neither always comes second.
            order = courses if trial % 2 == 0 else courses[::-1]
            if len({trajectory.run(trial) for trajectory in order}) != 1:
                raise RuntimeError(f"trial {trial} differs with recording")
        for trajectory in courses:
            trajectory.close()
    without, with_ = courses
    medians = [float(np.median(trajectory.ticks_us)) for trajectory in courses]
    return [
        Row("training, recorded", with_.seconds, "s", "not recorded", without.seconds),
        Row("median tick, recorded", medians[1], "us", "not recorded", medians[0]),
    ]
