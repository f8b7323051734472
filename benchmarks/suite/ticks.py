"""What a control tick costs, stage by stage, and what a run costs beside its physics."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from itertools import chain
from pathlib import Path
from time import perf_counter_ns, process_time_ns

import numpy as np
import pinocchio as pin

from benchmarks import cost, recording, supervision
from benchmarks.suite.rows import Form, Row
from palpate.adapters.config.run import scenario
from palpate.adapters.experiments.build import build_perception, build_task
from palpate.adapters.experiments.policies import learning_policy
from palpate.adapters.experiments.trial import trial_setup
from palpate.adapters.hardware.real_time import BUSY, Stopwatch, TickSection
from palpate.adapters.log.trial_recorder import TrialRecorder
from palpate.adapters.log.writer_client import ProcessSink
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.control_loop import run_trial
from palpate.core.motion.arm import arm_named
from palpate.core.motion.model import Kinematics, ToolGeometry
from palpate.core.trial import find_ready_pose

STAGES = {
    TickSection.FORCE: "read the force sensor",
    TickSection.JOINTS: "read the encoders",
    TickSection.PERCEIVE: "kinematics, tare, filter, phase, motion law",
    TickSection.CONTROL: "inverse kinematics",
    TickSection.SEND: "send the command",
    TickSection.RECORD: "record",
}


def stages(form: Form) -> list[Row]:
    """Medians of each stage, beside the physics of a tick and beside what Pinocchio alone takes."""
    stopwatch, physics_us = _timed_run(max(form.trials // 3, 2))
    floor = "physics of a tick"
    rows = [
        Row(name, stopwatch.spread(section).median_ns * 1e-3, "us", floor, physics_us)
        for section, name in STAGES.items()
    ]
    deciding_us = stopwatch.spread(TickSection.DECIDE).median_ns * 1e-3
    rows.append(Row("choice of an action, when one is due (median)", deciding_us, "us", floor, physics_us))
    supervised = supervision.measured(2, form.rounds)
    rows.append(Row("supervise", _median(supervised.checks_us), "us", floor, physics_us))
    rows.append(
        Row(
            "whole tick, recording and stopwatch included",
            stopwatch.spread(BUSY).median_ns * 1e-3,
            "us",
            floor,
            physics_us,
        )
    )
    bare = bare_kinematics_us(form.rounds)
    named = "Pinocchio's Jacobian and one 6x6 solve"
    rows.append(
        Row(STAGES[TickSection.CONTROL], stopwatch.spread(TickSection.CONTROL).median_ns * 1e-3, "us", named, bare)
    )
    return rows


def throughput(form: Form) -> list[Row]:
    """A whole training run against its physics."""
    found = cost.throughput(form.trials)
    per_tick = 1e6 / found.ticks
    ticks = cost.tick_us(max(form.trials // 4, 4))
    rows = [
        Row("training run", found.run_s * per_tick, "us a tick", "the same mj_step calls", found.floor_s * per_tick),
        Row("training run", found.run_s * per_tick, "us a tick", "one mj_step call a tick", found.strict_s * per_tick),
        Row("times real time, one core", found.ticks / cost.RATE_HZ / found.run_s, "(more is better)"),
    ]
    for name, us in ticks.items():
        rows.append(Row(f"{name}, median", _median(us), "us"))
        rows.append(Row(f"{name}, 99.9th percentile", float(np.quantile(us, 0.999)), "us"))
    return rows


def recorded(form: Form) -> list[Row]:
    """Training with recording against the same without."""
    _, found = recording.measured(max(form.trials * 2 // 3, 4), ("none", "process"), paced=False)
    without, with_ = found["none"], found["process"]
    return [
        Row("wall time of training, recorded", with_.whole_s, "s", "not recorded", without.whole_s),
        Row("tick's median, recorded", _median(with_.tick_us), "us", "not recorded", _median(without.tick_us)),
    ]


def _median(values: np.ndarray) -> float:
    return float(np.median(values))


def bare_kinematics_us(rounds: int, calls: int = 2000) -> float:
    """Microseconds of what inverse kinematics cannot do without: a Jacobian of the tip, and a linear system."""
    kinematics = Kinematics(arm_named("zebra-zero"), ToolGeometry())
    model, data = kinematics.model, kinematics.model.createData()
    tip, q, twist = model.getFrameId("tip"), np.array(kinematics.arm.posture_rad), np.ones(6)
    took = []
    for _ in range(rounds):
        began = process_time_ns()
        for _ in range(calls):
            pin.computeJointJacobians(model, data, q)
            pin.updateFramePlacement(model, data, tip)
            jacobian = pin.getFrameJacobian(model, data, tip, pin.ReferenceFrame.LOCAL)
            np.linalg.solve(jacobian @ jacobian.T + 1e-6 * np.eye(6), twist)
        took.append((process_time_ns() - began) * 1e-3 / calls)
    return float(np.median(took))


def _timed_run(trials: int) -> tuple[Stopwatch, float]:
    """A recorded training with a stopwatch in it, and the median of its physics a tick, in microseconds."""
    config = scenario("paper")
    ready, perception = find_ready_pose(config.arm, config.task), build_perception(config)
    policy, stopwatch = learning_policy(config, perception), Stopwatch()
    task = build_task(config, ready, perception, policy)
    physics: list[list[float]] = []
    with (
        tempfile.TemporaryDirectory() as folder,
        SimulatedRig(config, ready) as rig,
        TrialRecorder(
            lambda: ProcessSink(queue_bytes=4_096_000, patient=True), Path(folder), config.recording
        ) as recorder,
    ):
        recorder.of("bench", config, ready, task, perception, policy, frozen=False)
        rig.cell.advance = _watched(rig.cell.advance, physics)  # type: ignore[method-assign]
        for trial in range(trials):
            rig.prepare(trial)
            physics.append([])
            setup = trial_setup(config, trial)
            observers = (stopwatch, recorder.begin(setup, rig.world(), f"{trial}"), stopwatch.recording)
            recorder.end(run_trial(task, rig.ports, setup, None, observers), {})
    return stopwatch, float(np.median(list(chain.from_iterable(physics))))


def _watched(advance: Callable[[], None], physics: list[list[float]]) -> Callable[[], None]:
    def watched() -> None:
        began = perf_counter_ns()
        advance()
        physics[-1].append((perf_counter_ns() - began) * 1e-3)

    return watched
