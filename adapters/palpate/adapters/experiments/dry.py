"""Trials that read, decide and log, and move nothing."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from math import hypot
from typing import Final

import numpy as np
import pinocchio as pin
from typing_extensions import override

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments.build import build_supervisor, build_task
from palpate.adapters.experiments.evaluation import FIRST_EVALUATION_TRIAL, ChosenPolicy, at_work
from palpate.adapters.experiments.trial import ScoredTrial, interrupting, run_scored_trial
from palpate.adapters.hardware import find_approach, withdrawal
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.adapters.log import TrialRecorder
from palpate.core.control_loop import LoopObserver
from palpate.core.errors import DeviceError
from palpate.core.motion import Kinematics, arm_named
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    AppliedCommand,
    JointCommand,
    JointSample,
    JointVector,
    Rig,
    Snapshot,
    WrenchSample,
)
from palpate.core.trial import GoalConfig, Outcome, ReadyPose, Task, TrialReport, goal_in_base

_BEYOND_TICKS: Final = CONTROL_RATE_HZ // 10
"""Commands after the tare that are still shown: the task approaches, and no joint is yet too far from its set-point."""
_LONGEST_TICKS: Final = 10 * CONTROL_RATE_HZ


@dataclass
class DryWatch(LoopObserver):
    """Keeps what a dry trial sees, and ends it soon after the tare."""

    task: Task
    ticks: list[tuple[Snapshot, JointCommand]] = field(default_factory=list)
    report: TrialReport | None = None
    tared: int = 0

    @override
    def begun(self, start_ns: int, report: TrialReport) -> None:
        self.report = report

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        self.ticks.append((snapshot, command))
        if not self.tared and self.report is not None and any(each.name == "tare" for each in self.report.events):
            self.tared = len(self.ticks)
        if len(self.ticks) >= (self.tared + _BEYOND_TICKS if self.tared else _LONGEST_TICKS):
            self.task.interrupt()


def dry_trials(
    chosen: ChosenPolicy, config: RunConfig, rig: Rig, trials: int,
    recorder: TrialRecorder | None, session: RealTimeSession | None,
) -> tuple[list[DryWatch], ScoredTrial]:  # fmt: skip
    """Run the beginning of trials as if the tool were above the hole where it is; a trip or Ctrl-C ends them."""
    kinematics = Kinematics(arm_named(config.arm), config.tool.geometry)
    q_rad = rig.ports.joint_encoder.read().position_rad
    kinematics.update(q_rad)
    here, ready_here = (
        _moved(config, kinematics.tip_in_base),
        ReadyPose(np.array(q_rad), kinematics.tip_rotation.copy()),
    )
    supervisor, seen, ended = build_supervisor(here, ready_here, rig.sensor_facts, rig.latch), list[DryWatch](), False
    while True:
        policy, number = at_work(chosen.on(rig), rig), FIRST_EVALUATION_TRIAL + len(seen)
        task = build_task(here, ready_here, chosen.perception, policy)
        seen.append(DryWatch(task))
        if recorder is not None:
            recorder.of("run", here, ready_here, task, chosen.perception, policy, name=chosen.comparator)

        def end(task: Task = task) -> None:
            nonlocal ended
            ended = True
            task.interrupt()

        with interrupting(end):
            scored = run_scored_trial(
                here, rig, task, number, recorder, FIRST_EVALUATION_TRIAL, supervisor, session, (seen[-1],)
            )
        if ended or len(seen) >= trials or scored.report.outcome is not Outcome.INTERRUPTED:
            return seen, scored


def _moved(config: RunConfig, tip: pin.SE3) -> RunConfig:
    """The same with the hole straight below the tip."""
    plate = tip * pin.SE3(np.eye(3), np.array([0.0, 0.0, config.task.ready_height_mm * 1e-3]))
    upright = goal_in_base(GoalConfig()).rotation
    x_mm, y_mm, z_mm = (round(float(value) * 1e3, 6) for value in plate.translation)
    rpy = np.degrees(pin.rpy.matrixToRpy(plate.rotation @ upright.T)).tolist()
    goal = GoalConfig(x_mm, y_mm, z_mm, (rpy[0], rpy[1], rpy[2]))
    return replace(config, task=replace(config.task, goal=goal, start_uncertainty_mm=0.0))


def dry_lines(config: RunConfig, ready: ReadyPose, rig: Rig, watch: DryWatch) -> list[str]:
    """What a dry trial saw, line by line."""
    seen, facts = [snapshot for snapshot, _ in watch.ticks], rig.sensor_facts
    still = seen[: watch.tared or None]
    wrenches = np.array([(*each.wrench.force_N, *each.wrench.torque_Nm) for each in still])
    angles = np.array([each.joints.position_rad for each in still])
    mean, noise, q_rad = wrenches.mean(axis=0), wrenches.std(axis=0), tuple(angles[-1].tolist())
    return [
        f"force sensor: {_pace([(each.time_ns, each.wrench) for each in seen])}; ({_listed(mean[:3])}) N,"
        f" ({_listed(mean[3:])}) N m; noise {noise[:3].max():.3g} N, {noise[3:].max():.3g} N m"
        f" (stated {facts.noise_N:g} N, {facts.noise_Nm:g} N m)",
        f"joint angles: {_pace([(each.time_ns, each.joints) for each in seen])}; ({_listed(q_rad)}) rad,"
        f" moved by {1e3 * np.ptp(angles, axis=0).max():.2g} mrad",
        *_places(config, ready, q_rad),
        _asked(config, [command.position_rad for _, command in watch.ticks[watch.tared :]] if watch.tared else []),
    ]


def _listed(values: Iterable[float]) -> str:
    return ", ".join(f"{round(value, 4) + 0.0:.4g}" for value in values)


def _pace(samples: list[tuple[int, WrenchSample | JointSample]]) -> str:
    lasted_s = max((samples[-1][0] - samples[0][0]) * 1e-9, 1e-3)
    ages_ms = sorted(max(0.0, (time_ns - sample.source_time_ns) * 1e-6) for time_ns, sample in samples)
    rate_Hz = (len({sample.sequence for _, sample in samples}) - 1) / lasted_s
    return (
        f"{rate_Hz:.0f} new samples/s, age {ages_ms[len(ages_ms) // 2]:.1f} ms (median), {ages_ms[-1]:.1f} ms (highest)"
    )


def _places(config: RunConfig, ready: ReadyPose, q_rad: JointVector) -> tuple[str, str]:
    """Where the tip is, and what a run does first."""
    kinematics = Kinematics(arm_named(config.arm), config.tool.geometry)
    kinematics.update(q_rad)
    tip = kinematics.tip_in_base
    x, y, z = goal_in_base(config.task.goal).actInv(tip).translation * 1e3
    place = f"tip by the model of {config.arm}: ({_listed(1e3 * tip.translation)}) mm in the base"
    place += f", {-z:.1f} mm above the believed hole and {hypot(x, y):.1f} mm aside"
    try:
        approach = find_approach(config, ready)
        ticks = len(withdrawal(approach, q_rad))
    except DeviceError as error:
        return place, f"a run would not move from here: {error}"
    far_rad = max(abs(a - b) for a, b in zip(q_rad, approach.poses_rad[-1], strict=True))
    out = f"draw the tool straight out for {ticks / CONTROL_RATE_HZ:.1f} s, then " if ticks else ""
    return place, f"a run would first {out}go to the ready pose, joints by up to {far_rad:.3f} rad, from above"


def _asked(config: RunConfig, asked: list[JointVector]) -> str:
    if not asked:
        return "the task did not come to the end of its tare"
    kinematics, tips = Kinematics(arm_named(config.arm), config.tool.geometry), []
    for q_rad in (asked[0], asked[-1]):
        kinematics.update(q_rad)
        tips.append(kinematics.tip_in_base.copy())
    x, y, z = tips[0].actInv(tips[1]).translation * 1e3
    joints = _listed(1e3 * (b - a) for a, b in zip(asked[0], asked[-1], strict=True))
    return (
        f"first commands after the tare, {len(asked) / CONTROL_RATE_HZ:.2f} s: joints by ({joints}) mrad,"
        f" the tip by {z:.2f} mm along the tool and {hypot(x, y):.2f} mm across"
    )
