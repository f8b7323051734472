"""Move an arm slowly with a person nearby, and stop it at the first irregularity."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from math import ceil, dist
from typing import Final, NamedTuple

import numpy as np
import pinocchio as pin

from palpate.adapters.hardware import GuardedTicks
from palpate.core.errors import DeviceError
from palpate.core.motion import Array, InverseKinematics, Kinematics
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, JointVector, Life, Rig
from palpate.core.supervision import SampleMonitor, SupervisionConfig

SPEED_M_S: Final = 0.005
"""Maximum speed of the tip and the sensor."""
FORCE_N: Final = 10.0
"""Change in force since the start of a motion above which the arm is stopped."""
_TURN_RAD_S: Final = 0.1
_SETTLE_TICKS: Final = CONTROL_RATE_HZ // 2
_LEGS: Final = 4
"""Number of segments in a motion, each with a new reference force, because turning the tool changes the force."""


class Sample(NamedTuple):
    """One tick of a motion: joint angles, (n,) rad, and the wrench as measured, (6,) N and N m."""

    fresh: bool
    q_rad: JointVector
    wrench: tuple[float, ...]


class GuardedMoves:
    """Slow, guarded moves of an arm, commanded through its ports."""

    def __init__(
        self,
        rig: Rig,
        kinematics: Kinematics,
        limits: SupervisionConfig,
        loop: Callable[[], AbstractContextManager[object]] = nullcontext,
    ) -> None:
        self._rig, self.kinematics, self._limits, self._loop = rig, kinematics, limits, loop
        self._inverse = InverseKinematics(kinematics, PERIOD_S)
        self._requested: JointVector = ()
        self._ticks: GuardedTicks
        self._sequence = -1

    @contextmanager
    def moving(self) -> Iterator[None]:
        """Allow motion within the context, and always stop the arm when it exits."""
        rig, ports, arm = self._rig, self._rig.ports, self._rig.ports.arm
        with self._loop():
            if arm.life is Life.ACTIVE:
                arm.deactivate()
            arm.activate()
            try:
                self._requested = ports.joint_encoder.read().position_rad
                monitor = SampleMonitor(self._limits, rig.sensor_facts)
                self._ticks = GuardedTicks(ports, monitor, FORCE_N, "during calibration", rig.stopped_by)
                yield
            finally:
                arm.stop()

    def place(self, q_rad: JointVector | Array) -> pin.SE3:
        """Return the pose of the tip at these joint angles, in the base frame."""
        self.kinematics.update(q_rad)
        return self.kinematics.tip_in_base

    @property
    def requested_rad(self) -> JointVector:
        """The last commanded joint angles, (n,)."""
        return self._requested

    def joint_line(self, target_rad: JointVector | Array) -> None:
        """Move along a line in joint space within the tool's speed limit, and wait until the arm has settled."""
        begin, target = np.array(self._requested), np.asarray(target_rad)
        ticks = ceil(self._duration_s(begin, target) * CONTROL_RATE_HZ)
        for tick in range(1, ticks + 1):
            if (tick - 1) % max(ticks // _LEGS, 1) == 0:
                self._ticks.mark()
            self.tick(tuple((begin + (target - begin) * (tick / ticks)).tolist()))
        self.hold(_SETTLE_TICKS)

    def tip_line(self, target_in_base: pin.SE3, speed_m_s: float | None = None) -> Iterator[Sample]:
        """Move the tip along a line at constant orientation and yield each tick; motion ends when iteration does."""
        begin = self.place(self._requested)
        path_m = target_in_base.translation - begin.translation
        ticks = max(1, ceil(float(np.linalg.norm(path_m)) / (speed_m_s or SPEED_M_S) * CONTROL_RATE_HZ))
        for tick in range(1, ticks + 1):
            target = pin.SE3(begin.rotation, begin.translation + path_m * (tick / ticks))
            q_rad, limited = self._inverse.step(self._requested, target)
            if limited:
                raise DeviceError("rig", "the arm cannot move its tool straight from here: move it elsewhere by hand")
            yield self.tick(q_rad)

    def go(self, target_in_base: pin.SE3) -> None:
        """Move the tip along a straight line."""
        for _ in self.tip_line(target_in_base):
            pass

    def hold(self, ticks: int) -> list[Sample]:
        """Hold the pose and return the measurements; the last force becomes the reference for later forces."""
        readings = [self.tick(self._requested) for _ in range(ticks)]
        self._ticks.mark()
        return readings

    def tick(self, q_rad: JointVector) -> Sample:
        """Execute one control tick."""
        snapshot = self._ticks.tick(q_rad)
        wrench, self._requested = snapshot.wrench, q_rad
        fresh, self._sequence = wrench.sequence != self._sequence, wrench.sequence
        return Sample(fresh, snapshot.joints.position_rad, (*wrench.force_N, *wrench.torque_Nm))

    def _duration_s(self, begin: Array, target: Array) -> float:
        """Return the time for a line in joint space, limited by its fastest part."""
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
    """Return the wrenches in new samples, (n, 6)."""
    return np.array([each.wrench for each in readings if each.fresh])
