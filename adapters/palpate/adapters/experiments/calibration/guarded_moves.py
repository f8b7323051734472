"""Slow motion of an arm with a person close by, which stops at the first irregularity."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from math import ceil, dist
from typing import Final, NamedTuple

import numpy as np
import pinocchio as pin

from palpate.adapters.hardware import recent_force_N
from palpate.core.control_loop import next_slot, tick_time_ns
from palpate.core.errors import DeviceError
from palpate.core.motion import Array, InverseKinematics, Kinematics
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    PERIOD_S,
    CommandReason,
    JointCommand,
    JointVector,
    Life,
    Rig,
    Validity,
    Vector3,
)

SPEED_M_S: Final = 0.005
"""Highest speed of tip and sensor."""
FORCE_N: Final = 10.0
"""A change of the force by more than this since the start of a motion stops the arm."""
_TURN_RAD_S: Final = 0.1
_BLIND_TICKS: Final = CONTROL_RATE_HZ // 4
_SETTLE_TICKS: Final = CONTROL_RATE_HZ // 2
_LEGS: Final = 4
"""Parts of a motion, each with a new reference force, because the weight turns with the tool."""


class Sample(NamedTuple):
    """One tick of a motion: joint angles, (n,) rad, and the wrench as measured, (6,) N and N m."""

    fresh: bool
    q_rad: JointVector
    wrench: tuple[float, ...]


class GuardedMoves:
    """An arm that is moved slowly by the ports."""

    def __init__(
        self,
        rig: Rig,
        kinematics: Kinematics,
        loop: Callable[[], AbstractContextManager[object]] = nullcontext,
    ) -> None:
        self._rig, self._ports, self.kinematics, self._loop = rig, rig.ports, kinematics, loop
        self._inverse = InverseKinematics(kinematics, PERIOD_S)
        self._requested: JointVector = ()
        self._start_ns = self._slot = 0
        self._sequence = -1
        self._first_N: Vector3 = (0.0, 0.0, 0.0)

    @contextmanager
    def moving(self) -> Iterator[None]:
        """Allow motion within the context, and always stop the arm at its end."""
        arm, clock = self._ports.arm, self._ports.clock
        with self._loop():
            if arm.life is Life.ACTIVE:
                arm.deactivate()
            arm.activate()
            try:
                self._requested = self._ports.joint_encoder.read().position_rad
                self._start_ns, self._slot = clock.now_ns(), 0
                self._mark()
                yield
            finally:
                arm.stop()

    def place(self, q_rad: JointVector | Array) -> pin.SE3:
        """Return the pose of the tip at these joint angles, base frame."""
        self.kinematics.update(q_rad)
        return self.kinematics.tip_in_base

    @property
    def requested_rad(self) -> JointVector:
        """The last commanded joint angles, (n,)."""
        return self._requested

    def joint_line(self, target_rad: JointVector | Array) -> None:
        """Move straight in joint space within the speed limit of the tool, and wait until the arm has settled."""
        begin, target = np.array(self._requested), np.asarray(target_rad)
        ticks = ceil(self._duration_s(begin, target) * CONTROL_RATE_HZ)
        for tick in range(1, ticks + 1):
            if (tick - 1) % max(ticks // _LEGS, 1) == 0:
                self._mark()
            self.tick(tuple((begin + (target - begin) * (tick / ticks)).tolist()))
        self.hold(_SETTLE_TICKS)

    def tip_line(self, target_in_base: pin.SE3, speed_m_s: float | None = None) -> Iterator[Sample]:
        """Move the tip straight at constant orientation and yield each tick; the motion ends when iteration ends."""
        begin = self.place(self._requested)
        way = target_in_base.translation - begin.translation
        ticks = max(1, ceil(float(np.linalg.norm(way)) / (speed_m_s or SPEED_M_S) * CONTROL_RATE_HZ))
        for tick in range(1, ticks + 1):
            target = pin.SE3(begin.rotation, begin.translation + way * (tick / ticks))
            q_rad, limited = self._inverse.step(self._requested, target)
            if limited:
                raise DeviceError("rig", "the arm cannot move its tool straight from here: move it elsewhere by hand")
            yield self.tick(q_rad)

    def go(self, target_in_base: pin.SE3) -> None:
        """Move the tip straight."""
        for _ in self.tip_line(target_in_base):
            pass

    def hold(self, ticks: int) -> list[Sample]:
        """Hold the pose and return the measurements; the last force becomes the reference for later ones."""
        readings = [self.tick(self._requested) for _ in range(ticks)]
        self._mark()
        return readings

    def tick(self, q_rad: JointVector) -> Sample:
        """Execute one control tick."""
        clock, ports = self._ports.clock, self._ports
        for _ in range(_BLIND_TICKS):
            clock.sleep_until(tick_time_ns(self._start_ns, self._slot))
            now_ns = clock.now_ns()
            joints, wrench = ports.joint_encoder.read(), ports.force_sensor.read()
            seeing = joints.validity is Validity.VALID and wrench.validity is Validity.VALID
            if seeing and dist(wrench.force_N, self._first_N) > FORCE_N:
                raise DeviceError("rig", f"the force has changed by more than {FORCE_N:g} N: the arm was stopped")
            # Without valid sensor data the arm is commanded to hold its pose.
            requested = q_rad if seeing else self._requested
            applied = ports.arm.send(JointCommand(requested))
            self._slot = next_slot(self._start_ns, self._slot, now_ns)
            if applied.reason in (CommandReason.STOPPED, CommandReason.POSITION_LIMIT):
                # By then the fault that stopped the arm is known.
                ports.arm.stop()
                cause = self._rig.stopped_by()
                raise DeviceError("rig", f"the arm was held back: {applied.reason.value}{cause and f', {cause}'}")
            if seeing:
                self._requested = requested
                fresh, self._sequence = wrench.sequence != self._sequence, wrench.sequence
                values = (*wrench.force_N, *wrench.torque_Nm)
                return Sample(fresh, joints.position_rad, values)
        raise DeviceError("rig", f"joint sample {joints.validity.value}, force sample {wrench.validity.value}")

    def _mark(self) -> None:
        """Set the present force as the reference for later ones."""
        self._first_N = recent_force_N(self._ports)

    def _duration_s(self, begin: Array, target: Array) -> float:
        """Return the time for a line in joint space, from the fastest of its parts."""
        parts, before = 40, None
        longest_m = 0.0
        for part in range(parts + 1):
            tip = self.place(begin + (target - begin) * (part / parts))
            points = tip.translation, self.kinematics.sensor_in_base.translation
            if before is not None:
                longest_m = max(longest_m, *(dist(a, b) for a, b in zip(before, points, strict=True)))
            before = points
        turn_s = float(np.abs(target - begin).max()) / _TURN_RAD_S
        return max(longest_m * parts / SPEED_M_S, turn_s, PERIOD_S)


def fresh_wrenches(readings: Sequence[Sample]) -> Array:
    """Return the wrenches of new samples, (n, 6)."""
    return np.array([each.wrench for each in readings if each.fresh])
