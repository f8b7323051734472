"""Tip position, forces and torques in the task frame from raw port samples."""

from collections import deque
from math import atan2, hypot, pi, remainder, sqrt
from typing import Final, TypeAlias

import pinocchio as pin

from palpate.core.errors import DeviceError
from palpate.core.motion import FixedFrame, Kinematics, rotated, wrench_about
from palpate.core.perception import SignalProcessor, Wrench
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, JointSample, JointVector, Snapshot, Validity, Vector3

_ONE_TIME_NS: Final = 1_000_000_000 // CONTROL_RATE_HZ
"""Maximum age, relative to the encoder sample, for a force sample to count as simultaneous: one tick."""
_KEPT: Final = 16
"""Number of depths and deflections kept; the supervisor treats samples this many ticks apart as stale."""
History: TypeAlias = deque[tuple[int, float]]
"""Pairs of a time in ns and a value in m, latest last."""


class Measurement:
    """The first stage of every tick. The attributes describe the latest tick in SI units and the task frame.

    Args:
        signal: Processor that tares, scales and filters the six wrench channels.
        axial_N_per_m: Stiffness between flange and tip, along the tool axis.
        damping_s: Damping divided by stiffness for the same spring.

    Attributes:
        depth_step_m: Standard deviation of the tip position along the tool axis caused by encoder steps.
        tip_lever_m: Distance from the sensor's origin to the tip.
        position_m: Tip position from the encoders, (3,), without the gripper's deflection.
        tip_depth_m: Tip depth below the nominal plane, from the encoders and the spring and damper
            deflection, at the latest time for which both force and joint angles are known.
        turned_rad: Tool tilt and yaw, (2,); zero unless weight compensation is on, as for tools that turn.
        force_N: Tared, scaled, unfiltered force, (3,).
        force_norm_N: Norm of ``force_N``.
        torque_across_at_tip_Nm: Norm of the tared, scaled, unfiltered torque about the tip, across the tool axis; the
            lever of a contact at the tip is at most the tip's radius.
        filtered_force_z_N: Tared, scaled, filtered force along the tool axis.
    """

    turned_rad = (0.0, 0.0)

    def __init__(
        self,
        kinematics: Kinematics,
        task_in_base: pin.SE3,
        signal: SignalProcessor,
        axial_N_per_m: float,
        damping_s: float = 0.0,
    ) -> None:
        self._kinematics, self._signal = kinematics, signal
        # Fraction of the spring deflection reached in one tick; the damper carries the rest of the force.
        self._eased = min(PERIOD_S / (damping_s + 0.5 * PERIOD_S), 1.0)
        self.axial_N_per_m, self.depth_step_m = axial_N_per_m, kinematics.depth_step_m()
        self._task, self.joints = FixedFrame(task_in_base), kinematics.joints
        tip_in_sensor = kinematics.tip_in_sensor
        # Wrenches are first rotated into the tip's axes, so that one lever applies to all.
        self._to_tip = tip_in_sensor.rotation.T.tolist() if any(kinematics.tool.tip_rpy_rad) else None
        x, y, z = (-tip_in_sensor.inverse().translation).tolist()
        self._tip_in_sensor: Vector3 = (x, y, z)
        self.tip_lever_m = hypot(x, y, z)
        self._scale = signal.scale
        self._weight_N = self._above_tip_m = 0.0
        self.reset()

    def take_off_weight(self, weight_N: float, above_tip_m: float) -> None:
        """Compensate for the change in load that a tool of the given weight causes when it tilts.

        Args:
            weight_N: Weight of everything on the sensor.
            above_tip_m: Height of its centre of mass above the tip, on the tool's axis.
        """
        self._weight_N, self._above_tip_m = weight_N, above_tip_m

    def reset(self) -> None:
        """Reset all state, including tare and filter; the next tare sets both."""
        self._tip_in_base = self._kinematics.tip_rotation.tolist()
        self.tare((0.0,) * 6)
        self._filtered: Wrench = (0.0,) * 6
        self._depths, self._bends = History(maxlen=_KEPT), History(maxlen=_KEPT)
        self._axis: Vector3
        self.position_m: Vector3 = (0.0, 0.0, 0.0)
        self.force_N: Vector3
        self.force_norm_N: float
        self.filtered_force_z_N: float
        self.torque_across_at_tip_Nm: float
        self.tip_depth_m = 0.0

    def tare(self, bias: Wrench) -> None:
        """Use a wrench, six channels in the sensor frame, as the zero."""
        self._bias, self._bent_m = bias, 0.0
        self._upright_heading_rad: float | None = None
        self._signal.tare(bias)
        self._signal.reset(bias)

    @property
    def filter_state(self) -> list[float]:
        """Return the tare and the filter state."""
        return self._signal.get_state()

    def update(self, snapshot: Snapshot) -> None:
        """Process one tick.

        Raises:
            DeviceError: The number of joint angles differs from the number of joints.
        """
        (_, _, raw, joints, _), kinematics = snapshot, self._kinematics
        q_rad = joints.position_rad
        if len(q_rad) != self.joints:
            raise _wrong_number(q_rad, self.joints)
        kinematics.update(q_rad)
        self.position_m = self._task.place_m(kinematics.tip_position_m.tolist())
        self._tip_in_base = rotation = kinematics.tip_rotation.tolist()
        (a, b, c, u, v, w), (ka, kb, kc, ku, kv, kw) = self._bias, self._scale
        (fx, fy, fz), (tx, ty, tz) = raw.force_N, raw.torque_Nm
        force = ((fx - a) * ka, (fy - b) * kb, (fz - c) * kc)
        torque = ((tx - u) * ku, (ty - v) * kv, (tz - w) * kw)
        if self._to_tip is not None:
            force, torque = rotated(self._to_tip, force), rotated(self._to_tip, torque)
        self._live_N, self._live_Nm = force, torque
        self.force_N = self._task.vector_of(rotation, force)
        if self._weight_N:
            (_, _, u), (_, _, v), (_, _, w) = rotation
            self._axis = self._task.vector((u, v, w))
            self.force_N = self._lightened(self.force_N)
            self.turned_rad = self._turned_rad()
        x, y, z = self.force_N
        self.force_norm_N = sqrt(x * x + y * y + z * z)
        across_x, across_y, _ = wrench_about(force, torque, self._tip_in_sensor)
        self.torque_across_at_tip_Nm = hypot(across_x, across_y)
        self._filtered = filtered = self._signal.filtered((*force, *torque))
        self.filtered_force_z_N = filtered[2]
        self._bent_m += self._eased * (self.force_N[2] / self.axial_N_per_m - self._bent_m)
        self._bends.append((raw.source_time_ns, self._bent_m))
        self._depths.append((joints.source_time_ns, self.position_m[2]))
        time_ns = joints.source_time_ns
        if raw.source_time_ns < time_ns - _ONE_TIME_NS:
            time_ns = raw.source_time_ns
        self.tip_depth_m = _value_at(time_ns, self._depths) + _value_at(time_ns, self._bends)

    def _turned_rad(self) -> tuple[float, float]:
        """Return tilt and yaw. Yaw is the heading of the tool's x axis; 10 degrees of tilt change it by 0.4 degrees."""
        (ax, ay, az), ((u, _, _), (v, _, _), (w, _, _)) = self._axis, self._tip_in_base
        x, y, _ = self._task.vector((u, v, w))
        heading_rad = atan2(y, x)
        if self._upright_heading_rad is None:
            # The tool was upright when it was tared.
            self._upright_heading_rad = heading_rad
        yaw_rad = remainder(heading_rad - self._upright_heading_rad, 2.0 * pi)
        return hypot(ax, ay) if az > 0.0 else pi, yaw_rad

    def filtered_wrench_at_tip(self) -> tuple[Vector3, Vector3]:
        """Return the tared, filtered force, (3,) N, and the torque about the tip, (3,) N m.

        The tip is the reference point because sliding friction has no lever there. About the sensor, friction would
        hide the torque that indicates the hole.
        """
        fx, fy, fz, tx, ty, tz = self._filtered
        torque = wrench_about((fx, fy, fz), (tx, ty, tz), self._tip_in_sensor)
        force = self._task.vector_of(self._tip_in_base, (fx, fy, fz))
        torque = self._task.vector_of(self._tip_in_base, torque)
        if self._weight_N:
            return self._lightened(force), self._righted(torque)
        return force, torque

    def live_torque_at_tip_Nm(self) -> Vector3:
        """Return the tared and scaled torque about the tip, (3,), unfiltered to avoid a delay in the control loop."""
        torque_Nm = wrench_about(self._live_N, self._live_Nm, self._tip_in_sensor)
        torque = self._task.vector_of(self._tip_in_base, torque_Nm)
        return self._righted(torque) if self._weight_N else torque

    def _lightened(self, force_N: Vector3) -> Vector3:
        """Return a tared force without the weight component caused by tilt, as if the tare rotated with the tool."""
        (x, y, z), (ax, ay, az), weight_N = force_N, self._axis, self._weight_N
        return x + weight_N * ax, y + weight_N * ay, z - weight_N * (1.0 - az)

    def _righted(self, torque_Nm: Vector3) -> Vector3:
        (x, y, z), (ax, ay, _), moment_Nm = torque_Nm, self._axis, self._weight_N * self._above_tip_m
        return x + moment_Nm * ay, y - moment_Nm * ax, z


def require_place(joints: JointSample, count: int) -> None:
    """Reject the first joint sample of a trial if it does not give the arm's pose.

    Raises:
        DeviceError: The sample is not valid, or has the wrong number of joint angles.
    """
    if joints.validity is not Validity.VALID:
        raise DeviceError("joint encoder", f"the first sample of the trial is {joints.validity.value}")
    if len(joints.position_rad) != count:
        raise _wrong_number(joints.position_rad, count)


def _value_at(time_ns: int, history: History) -> float:
    """Interpolate the value at a time within the history; after its end, return the latest value."""
    after_ns, after_m = newest = history[-1]
    if time_ns >= after_ns:
        return after_m
    for then_ns, value_m in reversed(history):
        if then_ns <= time_ns:
            return value_m + (after_m - value_m) * (time_ns - then_ns) / (after_ns - then_ns)
        after_ns, after_m = then_ns, value_m
    return newest[1]


def _wrong_number(q_rad: JointVector, count: int) -> DeviceError:
    """Return the error to raise for a wrong number of joint angles."""
    return DeviceError("joint encoder", f"gives {len(q_rad)} joint angles, the arm has {count}")
