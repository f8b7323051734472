"""A bench for the simulated cell: the core's own motion and measurement over the ports, with no task on top.

Every figure is taken on the full six-joint arm, with the motion laws and gains of a trial. Only the white noise and
the bias of the wrist sensor are off; the encoders keep their steps. Lengths are in the task frame.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from math import atan2, cos, degrees, hypot, pi, remainder, sin
from types import TracebackType
from typing import Self

import numpy as np

from palpate.adapters.composition import (
    ReadyPose,
    SimulatedRig,
    build_perception,
    build_task,
    find_ready_pose,
    task_actions,
)
from palpate.adapters.config import RunConfig
from palpate.core.arms import arm_named
from palpate.core.control import ControlLaw, DampingControl, HybridControl, PositionControl
from palpate.core.cycle import run_trial, tick_time_ns
from palpate.core.insertion import PERIOD_S
from palpate.core.kinematics import Kinematics, ToolGeometry
from palpate.core.measurement import Measurement
from palpate.core.perception import SignalProcessor
from palpate.core.policy import RandomWalkPolicy
from palpate.core.task_config import CONTROL_RATE_HZ, N_PER_KGF
from palpate.core.task_frame import goal_in_base
from palpate.core.tip_motion import TipMotion
from palpate.core.trial import TrialReport, TrialSetup
from palpate.core.values import AppliedCommand, JointCommand, JointSample, Snapshot, Vector3, WrenchSample
from palpate.simulation.cell import Truth
from palpate.simulation.cell_config import CellConfig, ComplianceConfig, PegConfig, SensorConfig

SILENT = SensorConfig(force_noise_N=0.0, torque_noise_Nm=0.0, force_bias_N=0.0, torque_bias_Nm=0.0)
PASS_SPEED_M_S = 0.005
DROP_M = 1e-3
"""A peg that deep has found the hole."""


def quiet(
    arm: str = "zebra-zero",
    *,
    peg: PegConfig | None = None,
    compliance: ComplianceConfig | None = None,
    substeps: int = 5,
) -> RunConfig:
    """A run whose wrist sensor has neither noise nor bias."""
    cell = CellConfig(peg or PegConfig(), compliance or ComplianceConfig(), SILENT, substeps=substeps)
    return RunConfig(arm=arm, cell=cell)


@cache
def ready_pose(arm: str) -> ReadyPose:
    """The ready pose over the default goal; the same for every cell."""
    return find_ready_pose(RunConfig(arm=arm))


class Bench:
    """One work cell and what it takes to press, slide and push in it. A context manager.

    Attributes:
        rig: The cell and its ports.
        measurement: The core's view of the newest tick.
        press_N: Pressing force.
    """

    def __init__(self, config: RunConfig) -> None:
        arm, goal = arm_named(config.arm), goal_in_base(config.task.goal)
        ready = ready_pose(config.arm)
        task, control = config.task, config.control
        self.rig = SimulatedRig(config, ready)
        signal = SignalProcessor(CONTROL_RATE_HZ, config.perception.cutoff_Hz, config.perception.filter_order)
        self.measurement = Measurement(Kinematics(arm, ToolGeometry()), goal, signal)
        self._motion = TipMotion(Kinematics(arm, ToolGeometry()), goal, ready.tip_rotation, PERIOD_S)
        self.press_N = task.press_kgf * N_PER_KGF
        travel = task.travel_speed_mm_s * 1e-3
        axial_N_per_m = control.axial_stiffness_N_per_mm * 1e3
        along = DampingControl(control.damping_N_s_per_m, (0.0, 0.0, -self.press_N), travel, axial_N_per_m, PERIOD_S)
        self._free = PositionControl(control.position_gain_per_s, travel, PERIOD_S)
        self._press = HybridControl(self._free, along)
        self._slide = HybridControl(PositionControl(control.position_gain_per_s, PASS_SPEED_M_S, PERIOD_S), along)

    def __enter__(self) -> Self:
        self.rig.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.rig.__exit__(kind, error, trace)

    def hang_above(self, x_m: float, y_m: float) -> WrenchSample:
        """Start anew: go above (x, y), come to rest, tare there. Returns the raw reading at rest."""
        self.rig.prepare(0)
        self._start_ns, self._tick = self.rig.ports.clock.now_ns(), 0
        self.measurement.reset()
        sample = self._run(self._free, (x_m, y_m, -0.003), 50)
        self.measurement.tare((*sample.force_N, *sample.torque_Nm))
        return sample

    def press(self, x_m: float, y_m: float, ticks: int = 110) -> None:
        """Come down beside the hole and press until all is steady."""
        self.hang_above(x_m, y_m)
        self._run(self._press, (x_m, y_m, 0.0), ticks)

    def keep_pressing(self) -> None:
        """One more tick of pressing, without moving across."""
        self._run(self._press, self._motion.reference_m, 1)

    def enter_hole(self, depth_m: float) -> None:
        """Go straight down into the hole, not as far as its floor."""
        self.hang_above(0.0, 0.0)
        self._run(self._free, (0.0, 0.0, depth_m), 100)

    def push_to(self, x_m: float, y_m: float) -> Truth:
        """Push sideways at the present depth until all is steady."""
        self._run(self._free, (x_m, y_m, self._motion.reference_m[2]), 60)
        return self.rig.truth()

    def drops_on_the_way(self, x_m: float, y_m: float) -> bool:
        """Slide to (x, y) at ``PASS_SPEED_M_S``, pressing: whether the peg drops into the hole."""
        rx, ry, _ = self._motion.reference_m
        for _ in range(int(hypot(x_m - rx, y_m - ry) / PASS_SPEED_M_S * CONTROL_RATE_HZ) + 10):
            self._run(self._slide, (x_m, y_m, 0.0), 1)
            if self.rig.truth().depth_m > DROP_M:
                return True
        return False

    def penetration_m(self) -> float:
        """How far the deepest contact point of the peg is inside the plate."""
        return -min((contact.dist for contact in self.rig.cell.data.contact), default=0.0)

    def _run(self, law: ControlLaw, target_m: Vector3, ticks: int) -> WrenchSample:
        ports = self.rig.ports
        for _ in range(ticks):
            ports.clock.sleep_until(tick_time_ns(self._start_ns, self._tick))
            wrench, joints = ports.force_sensor.read(), ports.joint_encoder.read()
            if self._tick == 0:
                self._motion.start(joints.position_rad)
                self.measurement.tare((*wrench.force_N, *wrench.torque_Nm))
            self.measurement.update(Snapshot(self._tick, ports.clock.now_ns(), wrench, joints))
            velocity = law.velocity_m_s(self._motion.reference_m, target_m, self.measurement.force_N)
            ports.arm.send(self._motion.move(velocity))
            self._tick += 1
        return wrench


def headings(count: int) -> list[float]:
    """So many headings round the circle, rad; none is a symmetry axis of arm, peg or hole."""
    return [2 * pi * (k + 0.37) / count for k in range(count)]
