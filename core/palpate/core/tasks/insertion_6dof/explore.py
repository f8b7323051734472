"""The exploration in six degrees of freedom, with different controllers, until the peg is in the hole."""

from __future__ import annotations

from math import hypot, radians, sin
from typing import Final

from typing_extensions import override

from palpate.core.motion import AngularCompliance, DampingControl, limited, rotated
from palpate.core.policy import Action, ControllerKind, Spatial
from palpate.core.ports import PERIOD_S, ZERO_VELOCITY, Vector3
from palpate.core.tasks.contact import Monitor
from palpate.core.tasks.insertion.phases import Equipment, Explore
from palpate.core.tasks.insertion_6dof.insert import TILTED_RAD
from palpate.core.tasks.insertion_6dof.options import SpatialOptions

_FASTEST_PUSH_M_S: Final = 12e-3
_FASTEST_YAW_RAD_S: Final = radians(12.0)
_PULL_N: Final = 1.2
"""Pull that is light enough for every contact verification."""
_WEDGED_NM: Final = 0.15
_HELD_N: Final = 2.5
_GIVEN_M: Final = 3e-4
"""Maximum compliance of a tool wedged during a lift: 12 N in the gripper's spring, in case the sensor is wrong."""
_WITHDRAW_M_S: Final = 12e-3
_CLEAR_M: Final = 3e-4
"""Height of the lowest corner above the plate at which contact is ruled out."""
_WALL_N: Final = 1.0
"""Force that indicates contact with a wall."""
_RAISED_M: Final = 4e-4
"""Lift that frees a waiting tool: more than the dither, and 2 N of gripper force if it is held."""
_RAISED_AFTER: Final = 0.25
"""Fraction of the time-out period after which the tool is raised."""
_STEP: Final = Spatial()
_HOLD: Final = Spatial(ControllerKind.LIFT)
_SUNK_SHARE: Final = 0.62
"""Depth, divided by a tilted corner's depth, at which an upright pushing tool is in the hole."""
_DEEPEST_SHARE: Final = 0.93
"""Maximum depth for a pushing tool; the insertion, with its contact verification, covers the rest."""
_HEIGHT_GAIN_PER_S: Final = 5.0
_SWIFT: Final = 1.0
"""Compliance gain times the arm's lag; above 1, the tool oscillates at a wall, and at pi / 2 it never stops."""
_UPRIGHT_RAD: Final = radians(1.0)
"""Tilt above which a tool is on an edge or a corner, so that loss of contact does not indicate a hole."""


class SpatialExplore(Explore):
    """Exploration with actions in six degrees of freedom, each a motion at constant speed.

    Args:
        equipment: Objects shared by the phases.
        monitor: Contact monitor, which dithers the tool and holds it in place until the force responds.
        options: Options for the tool's compliance and its turn limits.
    """

    def __init__(self, equipment: Equipment, monitor: Monitor, options: SpatialOptions) -> None:
        super().__init__(equipment, monitor)
        self._free, self._along = equipment.controllers.free, equipment.controllers.along
        self._corner_m, self._sunk_m = options.corner_mm * 1e-3, _SUNK_SHARE * options.down_m
        self._deepest_m = min(_DEEPEST_SHARE * options.down_m, 0.4 * equipment.task.insertion_depth_mm * 1e-3)
        self._push_m_per_N_s = options.push_m_per_N_s
        self._swift_s = _SWIFT / (monitor.lateral_N_per_m * options.push_m_per_N_s)
        self._yawing = AngularCompliance(0.0, options.push_yaw_rad_per_Nms, _FASTEST_YAW_RAD_S)
        self._yaw_rad_per_Nms = max(options.push_yaw_rad_per_Nms, 1e-3)
        self._freeing = AngularCompliance(
            options.insert_tilt_rad_per_Nms, options.push_yaw_rad_per_Nms, _FASTEST_YAW_RAD_S
        )
        axial_N_per_m = equipment.measurement.axial_N_per_m
        damping_N_s_per_m = max(_PULL_N / _WITHDRAW_M_S, 2.0 * axial_N_per_m * PERIOD_S)
        pull = (0.0, 0.0, _PULL_N)
        self._pull = DampingControl(damping_N_s_per_m, pull, _WITHDRAW_M_S, axial_N_per_m, PERIOD_S)
        self._most_rad = radians(options.most_tilt_deg), radians(options.most_yaw_deg)

    @override
    def begin(self, start_m: tuple[float, float]) -> None:
        super().begin(start_m)
        self._path_m_s: Vector3 | None = None
        self._behind_m2_s, self._path_m2_s2, self._give = 0.0, 0.0, 1.0

    @override
    def resume(self) -> None:
        super().resume()
        # The hole was a false detection, or held the peg: stop and choose immediately.
        self._spatial, self._rate_rad_s, self._rise_m, self.countdown = _HOLD, ZERO_VELOCITY, 0.0, 1
        self._wedged_m: Vector3 | None = None

    @override
    def enter(self) -> None:
        super().enter()
        # The first pause lasts until the plate responds; during the approach, even a late force follows the motion.
        self._monitor.moves_on()
        self._spatial, self.countdown, self._monitor.spent = _STEP, 1, True

    @property
    def _upright(self) -> bool:
        return hypot(*self._motion.turn_rad[:2]) < _UPRIGHT_RAD

    @property
    def _low(self) -> bool:
        """Return True if the lowest corner may be in contact."""
        # The encoders alone give an upper bound on the height, independent of the force that corrects them.
        tip_m = max(self._measurement.tip_depth_m, self._measurement.position_m[2]) - self._state.surface_m
        if tip_m > -_CLEAR_M:
            return True
        return tip_m + self._corner_m * sin(hypot(*self._motion.turn_rad[:2])) > -_CLEAR_M

    def _look_for_lag(self, path_m_s: Vector3) -> None:
        """Update the trial-wide estimate of the encoders' lag behind a tool moving in air."""
        (x, y, z), (at_x, at_y, at_z), (vx, vy, vz) = self._motion.reference_m, self._measurement.position_m, path_m_s
        self._behind_m2_s += (x - at_x) * vx + (y - at_y) * vy + (z - at_z) * vz
        self._path_m2_s2 += vx * vx + vy * vy + vz * vz
        self._give = min(self._swift_s * self._path_m2_s2 / max(self._behind_m2_s, 1e-12), 1.0)

    @override
    def step(self) -> Vector3:
        controller = self._spatial.controller
        if self._path_m_s is not None:
            self._look_for_lag(self._path_m_s)
        if not self._low:
            self._monitor.free()
            self._wedged_m = None
        if controller is ControllerKind.STEP and self._upright:
            return super().step()
        if self._out_of_time():
            return ZERO_VELOCITY
        self._agent.effort_N.append(self._measurement.force_norm_N)
        if controller is ControllerKind.PUSH and self._upright and self._depth_m > self._sunk_m:
            self._state.event("sunk below the surface")
            self.over = True
            return ZERO_VELOCITY
        if not self._monitor.spent:
            self.countdown -= 1
        if self.countdown <= 0:
            self._perceive()
            return ZERO_VELOCITY
        return self._advance()

    def _perceive(self) -> None:
        super()._perceive()
        # The turn of the completed action continues at this tick, unless the next action turns otherwise.
        self._advance()

    def _begin(self, action: Action) -> None:
        super()._begin(action)
        self._motion.look_at_joints()
        self._spatial = spatial = action.spatial or _STEP
        (x, y, yaw), (u, v, w), (most_tilt, most_yaw) = self._motion.turn_rad, spatial.turn_rad, self._most_rad
        shrink = most_tilt / max(hypot(x + u, y + v), most_tilt)
        turned = (x + u) * shrink, (y + v) * shrink, min(max(yaw + w, -most_yaw), most_yaw)
        action_s = self._task.ticks_per_action * PERIOD_S
        self._rate_rad_s = (turned[0] - x) / action_s, (turned[1] - y) / action_s, (turned[2] - yaw) / action_s
        self._lost_ticks = self._deep_ticks = 0
        if spatial.controller is not ControllerKind.LIFT:
            self._wedged_m = None
        # The tip follows a lift only once the gripper is no longer compressed.
        compressed_m = max(self._motion.reference_m[2] - self._measurement.tip_depth_m, 0.0)
        self._rise_m = spatial.rise_m + compressed_m if spatial.rise_m else 0.0
        px, py = spatial.push_N
        size_N = hypot(px, py)
        self._monitor.push(
            (px / size_N, py / size_N)
            if spatial.controller in (ControllerKind.PUSH, ControllerKind.WITHDRAW) and size_N
            else None
        )
        if spatial.controller is ControllerKind.INSERT:
            self._state.event("insert")
            self.over = True

    def _refine_surface(self) -> None:
        if self._spatial.controller is ControllerKind.STEP and self._upright:
            super()._refine_surface()

    def _advance(self) -> Vector3:
        spatial, measured, reference_m = self._spatial, self._measurement, self._motion.reference_m
        give, self._path_m_s = self._give, None
        if spatial.controller is ControllerKind.STEP:
            velocity = self._wait() if self._monitor.spent and not self._upright else super()._advance()
            rate = self._rate_rad_s
        elif spatial.controller is ControllerKind.LIFT:
            ticks = self._task.ticks_per_action
            share = (ticks - self.countdown + 1) / ticks
            (x, y, z), (dx, dy) = self._step_from_m, self._step_m
            target_m = x + share * dx, y + share * dy, z - share * self._rise_m
            velocity, rate = self._free.velocity_m_s(reference_m, target_m, measured.force_N), self._rate_rad_s
            self._path_m_s = velocity
            if measured.force_N[2] > _PULL_N or hypot(*measured.force_N[:2]) > _HELD_N:
                velocity, rate, self._path_m_s = self._freed(velocity[2]), ZERO_VELOCITY, None
        elif spatial.controller is ControllerKind.PUSH:
            velocity = self._pushed(spatial.push_N)
            # A commanded yaw is a torque about the axis, with which the tool complies.
            tilt_x, tilt_y, yaw = self._rate_rad_s
            tx, ty, tz = measured.live_torque_at_tip_Nm()
            yaw_Nm = tz + yaw / self._yaw_rad_per_Nms
            if hypot(tx, ty) > _WEDGED_NM + self._press_N * hypot(*spatial.pivot_m):
                # More than the pressing force at the corner: turning further upright would load a wedge.
                tilt_x = tilt_y = 0.0
            rate = tilt_x, tilt_y, give * self._yawing.rate_rad_s((0.0, 0.0, yaw_Nm))[2]
        elif spatial.controller is ControllerKind.WITHDRAW:
            vx, vy, _ = self._pushed(spatial.push_N)
            torque_Nm = measured.live_torque_at_tip_Nm()
            (u, v, w), (a, b, c) = self._freeing.rate_rad_s(torque_Nm), self._rate_rad_s
            if hypot(*torque_Nm[:2]) > _WEDGED_NM:
                # Turning would load the wedge; the tool complies first.
                a = b = 0.0
            x, y, _ = self._motion.turn_rad
            a, b = give * u + a, give * v + b
            deep = self._measurement.position_m[2] - self._state.surface_m > self._deepest_m
            if deep and hypot(x + a * PERIOD_S, y + b * PERIOD_S) > max(hypot(x, y), TILTED_RAD):
                # Impossible for a peg in the hole: the torque is not a wall's, and a peg tilted like this would bend
                # the gripper.
                a = b = 0.0
            velocity, rate = (vx, vy, self._pulled_m_s()), (a, b, give * w + c)
        else:
            velocity = rate = ZERO_VELOCITY
        if self._monitor.spent:
            rate = ZERO_VELOCITY
        if rate != ZERO_VELOCITY:
            velocity = self._about_pivot(velocity, self._motion.turn(rate))
        dithers = self._low or spatial == _HOLD
        if not dithers or spatial.controller is ControllerKind.STEP:
            return velocity
        # A dither underestimates the lag of the servos.
        self._path_m_s = None
        return self._dithering(velocity)

    def _dithering(self, velocity_m_s: Vector3) -> Vector3:
        """Add the dither to a velocity, including laterally at a wall; if the budget is spent, only dither in place."""
        monitor, (vx, vy, vz), (fx, fy, _) = self._monitor, velocity_m_s, self._measurement.force_N
        ux, uy = monitor.direction or (0.0, 0.0)
        if not monitor.spent:
            monitor.moves_on()
        else:
            monitor.wait("while the tool pushes")
            vx, vy, vz = 0.0, 0.0, min(vz, 0.0)
            # Intermittent contact responds to neither dither; slightly higher and off the wall, the tool is free.
            late = monitor.waited_ticks / monitor.timeout_ticks - _RAISED_AFTER
            if late > 0.0:
                rises = late < _RAISED_M / (_WITHDRAW_M_S * PERIOD_S * monitor.timeout_ticks)
                back, up = (_WITHDRAW_M_S, -_WITHDRAW_M_S) if rises else (0.0, vz)
                return -back * ux, -back * uy, up + monitor.dither_m_s()
        if hypot(fx, fy) > _WALL_N:
            monitor.aim((fx, fy))
            ux, uy = monitor.direction or (0.0, 0.0)
        if monitor.direction is not None and (monitor.spent or -(fx * ux + fy * uy) > _WALL_N):
            along = monitor.push_dither_m_s(met=monitor.spent)
            vx, vy = vx + along * ux, vy + along * uy
        return vx, vy, vz + monitor.dither_m_s()

    def _freed(self, lift_m_s: float) -> Vector3:
        """Return the velocity for a tool wedged during a lift: it complies, and moves up unless it is blocked."""
        (x, y, z), (fx, fy, fz), k = (
            self._motion.reference_m,
            self._measurement.force_N,
            self._give * self._push_m_per_N_s,
        )
        if self._wedged_m is None:
            self._wedged_m = x, y, z
        wedged_x, wedged_y, wedged_z = self._wedged_m
        vx, vy, _ = limited((k * fx, k * fy, 0.0), _FASTEST_PUSH_M_S)
        if hypot(x + vx * PERIOD_S - wedged_x, y + vy * PERIOD_S - wedged_y) > _GIVEN_M:
            vx = vy = 0.0
        if fz <= _PULL_N:
            return vx, vy, lift_m_s
        return vx, vy, self._pulled_m_s() if z - wedged_z < _GIVEN_M else 0.0

    def _pulled_m_s(self) -> float:
        """Return the velocity along the axis that limits the pull."""
        reference_m = self._motion.reference_m
        return self._pull.velocity_m_s(reference_m, reference_m, (0.0, 0.0, self._measurement.force_N[2]))[2]

    def _pushed(self, push_N: tuple[float, float]) -> Vector3:
        reference_m, (fx, fy, fz), k = (
            self._motion.reference_m,
            self._measurement.force_N,
            self._give * self._push_m_per_N_s,
        )
        (px, py), (dx, dy), action_s = push_N, self._step_m, self._task.ticks_per_action * PERIOD_S
        # The step is fed forward, less so the larger the opposing force.
        free = min(max(1.0 + (fx * px + fy * py) / max(px * px + py * py, 1e-6), 0.0), 1.0) / action_s
        vx, vy, _ = limited((k * (fx + px) + free * dx, k * (fy + py) + free * dy, 0.0), _FASTEST_PUSH_M_S)
        vz = self._along.velocity_m_s(reference_m, reference_m, (0.0, 0.0, fz))[2]
        if rise_m := self._spatial.rise_m:
            vz = min(vz, -_HEIGHT_GAIN_PER_S * (rise_m + self._depth_m))
            if fz > _PULL_N:
                vz = max(vz, 0.0)
        elif self._depth_m > self._deepest_m:
            vz = min(vz, 0.0)
        x, y = reference_m[0] + vx * PERIOD_S, reference_m[1] + vy * PERIOD_S
        within_x, within_y = self.area.clamp(x, y)
        return vx if within_x == x else 0.0, vy if within_y == y else 0.0, vz

    def _about_pivot(self, velocity_m_s: Vector3, rate_rad_s: Vector3) -> Vector3:
        """Return the velocity that keeps the pivot in place while the tool turns about the tip."""
        (x, y, z), (wx, wy, wz) = velocity_m_s, rate_rad_s
        px, py, pz = rotated(self._motion.tilt, (*self._spatial.pivot_m, 0.0))
        return x - (wy * pz - wz * py), y - (wz * px - wx * pz), z - (wx * py - wy * px)
