"""Commissioning steps, each of which moves the arm and makes an estimate from the measurements."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import replace
from math import cos, radians, sin
from typing import Final

import numpy as np
import pinocchio as pin

from palpate.adapters.config import RunConfig, overlay
from palpate.adapters.experiments.build import build_task, supervisor_of
from palpate.adapters.experiments.calibration import estimates
from palpate.adapters.experiments.calibration.guarded_moves import GuardedMoves, Sample, fresh_wrenches
from palpate.adapters.experiments.evaluation import ChosenPolicy
from palpate.adapters.experiments.trial import trial_setup
from palpate.adapters.hardware import TurnedForceSensor, find_approach, withdrawal
from palpate.core.control_loop import run_trial
from palpate.core.errors import DeviceError, UndeterminedError, UnreachableError
from palpate.core.motion import InverseKinematics, Kinematics, arm_named
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, Rig
from palpate.core.trial import Outcome, ReadyPose, find_ready_pose, goal_in_base

_TILTS_DEG: Final = (25.0, 20.0, 15.0)
"""Tool tilts. Larger tilts give better estimates, but an arm near its limits reaches few of them."""
_HEADINGS_DEG: Final = (0.0, 60.0, 120.0, 180.0, 240.0, 300.0)
_LEAST_TILTED: Final = 3
_NEAR_RAD: Final = 1.5
_MIDDLE: Final = 0.5
_HOLD_TICKS: Final = 2 * CONTROL_RATE_HZ
_TARE_TICKS: Final = CONTROL_RATE_HZ
_ASIDE_M: Final = 0.005
_PLACES: Final = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
_ABOVE_M: Final = 0.008
_AGAIN_M: Final = 0.002
_TOUCH_N: Final = 1.5
_PRESS_N: Final = 6.0
_FELT_N: Final = 1.0
_DOWN_M_S: Final = 0.001
_PRESS_M_S: Final = 0.0002
_PLATE_APART_M: Final = 3e-4
_STIFFNESS_APART: Final = 0.1
_INSERTIONS: Final = 3
_CAREFUL: Final = {
    "start_uncertainty_mm": 1.5, "travel_speed_mm_s": 5.0, "press_kgf": 0.3, "step_mm": 0.5, "max_force_N": 10.0,
    "time_limit_s": 60.0,
}  # fmt: skip
"""Task settings for insertions during commissioning: ten steps per second give 5 mm/s."""


class Commissioning:
    """The steps for commissioning a rig."""

    def __init__(
        self,
        rig: Rig,
        config: RunConfig,
        loop: Callable[[], AbstractContextManager[object]] = nullcontext,
        notify: Callable[[str], object] = str,
    ) -> None:
        self._rig, self._loop, self._notify = rig, loop, notify
        self._poses: list[estimates.Array] = []
        self._description = arm_named(config.arm)
        self._tool = config.tool.geometry
        self._kinematics = Kinematics(self._description, self._tool)
        self.arm = GuardedMoves(rig, self._kinematics, config.supervision, loop)
        self.believe(config)

    def believe(self, config: RunConfig) -> None:
        """Use a new configuration for the plate and hole from now on."""
        self.config = overlay(config, {"task": _CAREFUL})
        self._goal = goal_in_base(config.task.goal)
        self._ready: ReadyPose = find_ready_pose(config.arm, config.tool.geometry, config.task)
        self._approach = find_approach(config, self._ready)

    def plan_payload(self) -> list[estimates.Array]:
        """Find the poses for :meth:`payload` in advance, because the search may exceed device time-outs."""
        above = np.array(self._approach.poses_rad[0])
        self._poses = [above, *self._tilted(above), above]
        return self._poses

    def payload(self) -> estimates.Payload:
        """Turn the tool about its centre, well above the plate, and return the load on the sensor."""
        down, means, sds = [], [], []
        poses = self._poses or self.plan_payload()
        with self.arm.moving():
            self._go_above()
            for number, pose in enumerate(poses, start=1):
                self._notify(f"pose {number} of {len(poses)}")
                self.arm.joint_line(pose)
                readings = self.arm.hold(_HOLD_TICKS)
                mean, sd = estimates.mean_of(fresh_wrenches(readings))
                rotation = self.arm.place(np.mean([each.q_rad for each in readings], axis=0)).rotation
                down.append(-rotation[2])
                means.append(mean)
                sds.append(sd)
        return estimates.payload(np.array(down), np.array(means), np.array(sds))

    def plate(self) -> tuple[estimates.Estimate, estimates.Estimate]:
        """Press around the hole; return the plate's height (m, base frame) and the stiffness along the tool (N/m)."""
        results: list[tuple[estimates.Estimate, estimates.Estimate]] = []
        with self.arm.moving():
            self._go_above()
            height_m = -_ABOVE_M
            for number, (x, y) in enumerate(_PLACES, start=1):
                self._notify(f"point {number} of {len(_PLACES)}")
                results.append(estimates.press(*self._press_at(x * _ASIDE_M, y * _ASIDE_M, height_m)))
                height_m = results[-1][0].value - _AGAIN_M
            self._lift()
        surfaces, found = zip(*results, strict=True)
        depth = estimates.joined("plate's height", surfaces, _PLATE_APART_M, "m")
        mean = float(np.mean([each.value for each in found]))
        stiffness = estimates.joined("stiffness", found, _STIFFNESS_APART * mean, "N/m")
        return estimates.Estimate(float(self._goal.translation[2]) - depth.value, depth.sd), stiffness

    def insert(self, mounting_deg: float, weight_N: float = 0.0) -> tuple[estimates.Estimate, estimates.Estimate]:
        """Insert the peg slowly a few times, guided by its torque; the core verifies that it is in the hole.

        Returns the hole position, (x, y) in m in the base frame. A weight of 0 selects the configured masses.

        Raises:
            UndeterminedError: The peg was not inserted.
            DeviceError: The supervisor tripped.
        """
        ports = self._rig.ports
        turned = replace(ports, force_sensor=TurnedForceSensor(ports.force_sensor, mounting_deg))
        chosen = ChosenPolicy("torque", self.config)
        control = self.config.control
        if weight_N:
            control = replace(control, rigid_mass_kg=max(weight_N / 9.81 - control.moving_mass_kg, 0.0))
        task = build_task(replace(self.config, control=control), self._ready, chosen.perception, chosen.on(self._rig))
        places = []
        for trial in range(_INSERTIONS):
            self._notify(f"insertion {trial + 1} of {_INSERTIONS}")
            with self.arm.moving():
                if trial:
                    self._withdraw()
                else:
                    self._go_above()
                self.arm.joint_line(self._approach.poses_rad[-1])
            supervisor = supervisor_of(self._rig, self.config, self._ready)
            ports.arm.deactivate()
            ports.arm.activate()
            with self._loop():
                report = run_trial(task, turned, trial_setup(self.config, trial), supervisor)
            if report.trip is not None:
                raise DeviceError("rig", f"insertion {trial + 1}: {report.trip}")
            if report.outcome is not Outcome.INSERTED:
                outcome = "nothing" if report.outcome is None else report.outcome.value
                problem = f"insertion {trial + 1} ended with {outcome}: {report.events[-1].detail}"
                raise UndeterminedError("hole's place", problem, "a nominal place within 3 mm (--place)")
            x, y, _ = self._goal.act(np.array(task.tip_m))
            places.append((float(x), float(y)))
        return estimates.hole(places, 2e-3 * self.config.cell.peg.clearance_mm)

    def _withdraw(self) -> None:
        """Withdraw the tool from the hole, if it is in one."""
        for pose in withdrawal(self._approach, self.arm.requested_rad):
            # The motion is planned for 20 mm/s.
            for _ in range(4):
                self.arm.tick(pose)

    def _go_above(self) -> None:
        """Withdraw the tool and lift it well above the expected hole."""
        self._notify("moving to 100 mm above the nominal hole")
        self._withdraw()
        self.arm.joint_line(self._approach.poses_rad[0])

    def _lift(self) -> None:
        tip = self.arm.place(self.arm.requested_rad)
        self.arm.go(pin.SE3(tip.rotation, tip.translation + np.array([0.0, 0.0, _ABOVE_M])))

    def _tilted(self, above_rad: estimates.Array) -> list[estimates.Array]:
        """Return poses that tilt the tool about its centre and that the arm can reach without flipping."""
        tip = self.arm.place(above_rad)
        lever = np.array([0.0, 0.0, _MIDDLE * (self._tool.sensor_m[2] + self._tool.tip_m[2])])
        middle = tip.act(-lever)
        inverse = InverseKinematics(Kinematics(self._description, self._tool), PERIOD_S)

        def poses_at(tilt_deg: float) -> list[estimates.Array]:
            poses = []
            for heading in _HEADINGS_DEG:
                axis = np.array([cos(radians(heading)), sin(radians(heading)), 0.0])
                rotation = tip.rotation @ pin.exp3(radians(tilt_deg) * axis)
                target = pin.SE3(rotation, middle + rotation @ lever)
                with suppress(UnreachableError):
                    poses.append(inverse.solve(target, free_yaw=False, seed_rad=above_rad, field="place"))
            return [q for q in poses if float(np.abs(q - above_rad).max()) < _NEAR_RAD]

        for tilt_deg in _TILTS_DEG:
            if len(poses := poses_at(tilt_deg)) >= _LEAST_TILTED:
                return poses
        problem = (
            f"the arm can tilt its tool by {tilt_deg:g} degrees in {len(poses)} of {len(_HEADINGS_DEG)} directions"
        )
        raise UndeterminedError("weight", problem, "a place further from the arm's limits (--place)")

    def _press_at(self, x_m: float, y_m: float, height_m: float) -> estimates.Array:
        """Press on the plate at a point in the task frame; return depth (m), force (N), +1 (in) or -1 (out), (3, n)."""
        arm, rotation = self.arm, self._ready.tip_rotation

        def at(depth_m: float) -> pin.SE3:
            return pin.SE3(rotation, self._goal.act(np.array([x_m, y_m, depth_m])))

        here = float(self._goal.actInv(arm.place(arm.requested_rad)).translation[2])
        for depth_m in (min(here, height_m), height_m):
            arm.go(at(depth_m))
        arm.hold(_TARE_TICKS)
        zero_N = float(fresh_wrenches(arm.hold(_TARE_TICKS))[:, 2].mean())

        def force_N(readings: Sample) -> float:
            # Pressing causes a negative force along the tool's axis, independent of the sensor's mounting angle.
            return zero_N - readings.wrench[2]

        lowest = at(_ABOVE_M)
        if not any(force_N(readings) > _TOUCH_N for readings in arm.tip_line(lowest, _DOWN_M_S)):
            problem = f"no contact down to {_ABOVE_M * 1e3:g} mm below its nominal height"
            raise UndeterminedError("plate's height", problem, "a more accurate nominal height (--place.z-mm)")
        rows = []
        for direction, target in ((1.0, lowest), (-1.0, at(height_m))):
            for readings in arm.tip_line(target, _PRESS_M_S):
                force = force_N(readings)
                if readings.fresh and force > _FELT_N:
                    rows.append((float(self._goal.actInv(arm.place(readings.q_rad)).translation[2]), force, direction))
                if force > _PRESS_N if direction > 0.0 else force < _FELT_N:
                    break
        arm.go(at(height_m))
        return np.array(rows).T
