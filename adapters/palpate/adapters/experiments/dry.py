"""Dry runs: the beginning of a trial with measurements, decisions and a log, but without motion."""

from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from math import hypot
from typing import Final

import numpy as np
import pinocchio as pin
from typing_extensions import override

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments.evaluation import FIRST_EVALUATION_TRIAL, ChosenPolicy
from palpate.adapters.experiments.results import RunFolder
from palpate.adapters.experiments.run import Run
from palpate.adapters.experiments.trial import ScoredTrial, interrupting
from palpate.adapters.experiments.trials import NOT_RECORDED, Recording, Trials
from palpate.adapters.hardware import find_approach, withdrawal
from palpate.core.control_loop import LoopObserver
from palpate.core.errors import DeviceError
from palpate.core.motion import Kinematics, arm_named
from palpate.core.ports import CONTROL_RATE_HZ, AppliedCommand, JointCommand, JointVector, Rig, Snapshot
from palpate.core.trial import GoalConfig, ReadyPose, Task, TrialReport, goal_in_base

_BEYOND_TICKS: Final = CONTROL_RATE_HZ // 10
"""Number of commands shown after the tare, while the task approaches and all joints are near their set-points."""
_LONGEST_TICKS: Final = 10 * CONTROL_RATE_HZ


@dataclass
class _Observer(LoopObserver):
    """Observer that stores forces until the end of the tare, then commands, and ends the trial soon after."""

    task: Task
    forces_N: list[tuple[float, ...]] = field(default_factory=list)
    requested: list[JointVector] = field(default_factory=list)
    report: TrialReport | None = None

    @override
    def begun(self, start_ns: int, report: TrialReport) -> None:
        self.report = report

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        if self.report is not None and any(each.name == "tare" for each in self.report.events):
            self.requested.append(command.position_rad)
        else:
            self.forces_N.append(snapshot.wrench.force_N)
        if len(self.requested) > _BEYOND_TICKS or len(self.forces_N) > _LONGEST_TICKS:
            self.task.interrupt()


def dry_run(run: Run, policy: str, folder: RunFolder) -> tuple[ScoredTrial, list[str], Recording]:
    """Run the beginning of a trial on a rig whose arm does not move; return the observations as lines.

    Raises:
        ConfigurationError: A setting or the policy is rejected.
        OutputError: The folder already holds a run.
    """
    folder.require_free()
    chosen = run.chosen(policy)
    with ExitStack() as kept, run.opened() as rig, ExitStack() as opened:
        run.begin(kept, folder, "run", trials=1, policy=chosen.name)
        recording = run.record(kept, opened, folder)
        scored, lines = dry_trial(chosen, run.config, run.ready, rig, recording)
    return scored, lines, recording


def dry_trial(
    chosen: ChosenPolicy, config: RunConfig, ready: ReadyPose, rig: Rig, recording: Recording = NOT_RECORDED
) -> tuple[ScoredTrial, list[str]]:
    """Run the beginning of a trial as if the hole were below the tool; return the observations as lines."""
    q_rad = rig.ports.joint_encoder.read().position_rad
    tip = _tip(config, q_rad)
    here, ready_here, first = _moved(config, tip), ReadyPose(np.array(q_rad), tip.rotation), FIRST_EVALUATION_TRIAL
    trials = Trials(
        here, ready_here, rig, chosen.perception, chosen.on(rig), recording, name=chosen.baseline, first=first
    )
    observer = _Observer(trials.task)
    with interrupting(trials.task.interrupt):
        scored = trials.run(first, (observer,))
    x, y, z = goal_in_base(config.task.goal).actInv(tip).translation * 1e3
    place = f"tip by the model of {config.arm}: ({_listed(1e3 * tip.translation)}) mm in the base"
    place += f", {-z:.1f} mm above the nominal hole and {hypot(x, y):.1f} mm aside"
    lines = [place, _way(config, ready, q_rad), _requested(config, observer.requested)]
    if observer.forces_N:
        mean, noise_N = np.mean(observer.forces_N, axis=0), np.std(observer.forces_N, axis=0).max()
        lines.insert(0, f"force ({_listed(mean)}) N, noise {noise_N:.3g} N (stated {rig.sensor_facts.noise_N:g} N)")
    return scored, lines


def _moved(config: RunConfig, tip: pin.SE3) -> RunConfig:
    """Return the configuration with the hole directly below the tip."""
    plate = tip * pin.SE3(np.eye(3), np.array([0.0, 0.0, config.task.ready_height_mm * 1e-3]))
    upright = goal_in_base(GoalConfig()).rotation
    x_mm, y_mm, z_mm = (round(float(value) * 1e3, 6) for value in plate.translation)
    rpy = np.degrees(pin.rpy.matrixToRpy(plate.rotation @ upright.T)).tolist()
    goal = GoalConfig(x_mm, y_mm, z_mm, (rpy[0], rpy[1], rpy[2]))
    # Commands do not reach the arm.
    weakened = (*config.supervision.weakened, "max_tracking_error_mrad")
    supervision = replace(config.supervision, max_tracking_error_mrad=500.0, weakened=weakened)
    task = replace(config.task, goal=goal, start_uncertainty_mm=0.0)
    return replace(config, task=task, supervision=supervision)


def _tip(config: RunConfig, q_rad: JointVector) -> pin.SE3:
    kinematics = Kinematics(arm_named(config.arm), config.tool.geometry)
    kinematics.update(q_rad)
    return kinematics.tip_in_base.copy()


def _listed(values: Iterable[float]) -> str:
    return ", ".join(f"{round(value, 4) + 0.0:.4g}" for value in values)


def _way(config: RunConfig, ready: ReadyPose, q_rad: JointVector) -> str:
    try:
        approach = find_approach(config, ready)
        ticks = len(withdrawal(approach, q_rad))
    except DeviceError as error:
        return f"a run would not move from here: {error}"
    far_rad = max(abs(a - b) for a, b in zip(q_rad, approach.poses_rad[-1], strict=True))
    out = f"retract the tool for {ticks / CONTROL_RATE_HZ:.1f} s, then " if ticks else ""
    return f"a run would first {out}go to the ready pose, joints by up to {far_rad:.3f} rad, from above"


def _requested(config: RunConfig, requested: list[JointVector]) -> str:
    if not requested:
        return "the task did not finish its tare"
    x, y, z = _tip(config, requested[0]).actInv(_tip(config, requested[-1])).translation * 1e3
    return f"first commands after the tare: the tip by {z:.2f} mm along the tool and {hypot(x, y):.2f} mm across"
