"""What the emulated servos move: the motors and, behind the gears, the arm."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp
from typing import Annotated, Final, Protocol, TypeAlias

from typing_extensions import override

from palpate.core.ports import Holds, JointVector, Range, Settings
from palpate.simulation.emulators.motors.gears import AXES, HOME_RAD, ArmGears

_S_PER_NS: Final = 1e-9
_Six: TypeAlias = Annotated[tuple[float, ...], Holds(lambda values: len(values) == AXES, f"{AXES} numbers")]


class Plant(Protocol):
    """The motors as the servo modules control them. Counts are absolute: zero is the home pose, whatever is preset.

    All methods are called from the thread that runs the modules. A motor has one of three states: held at a set-point,
    driven open-loop, or free (open-loop with no duty).
    """

    def set_motor_counts(self, axis: int, counts: float) -> None:
        """The servo of an axis (0 to 5) now holds this position, in counts."""

    def set_motor_duty(self, axis: int, duty: float) -> None:
        """The motor runs open-loop with this share of full voltage, -1 to 1; 0 leaves it free."""

    def motor_counts(self, axis: int) -> int:
        """What the encoder on the motor's shaft counts now."""

    def advance(self, now_ns: int) -> None:
        """Let time go on until `now_ns`."""


@dataclass(frozen=True, slots=True)
class MotorModel(Settings):
    """How motors fall short of their set-points. The defaults follow exactly."""

    lag_s: Annotated[float, Range(0.0)] = 0.0
    """Time constant of the first-order lag of a held motor behind its set-point."""
    load_counts: _Six = (0.0,) * AXES
    """Steady error under static load, (6,) counts, added to what a held motor reaches."""
    free_speed_counts_per_s: _Six = (60_000.0,) * AXES
    """Speed at full duty without load, (6,) counts/s (assumed: nothing is published)."""
    wrist_backlash_rad: Annotated[float, Range(0.0)] = 0.0
    """Full gap of the gears of joints 4 to 6 (assumed; 0.1 degree is plausible, but not default, because it hides what
    else is wrong)."""


class _Backlash:
    """Joints behind gears with play: each stays where it is until its gear has taken up the gap."""

    def __init__(self, gap_rad: float, joints_rad: JointVector) -> None:
        self._half_rad = (0.0, 0.0, 0.0, *(gap_rad / 2,) * 3)
        self._joints_rad = joints_rad

    def follow(self, gears_rad: JointVector) -> JointVector:
        """Where the joints are once the gears have moved to these angles."""
        self._joints_rad = tuple(
            min(max(joint, gear - half), gear + half)
            for joint, gear, half in zip(self._joints_rad, gears_rad, self._half_rad, strict=True)
        )
        return self._joints_rad


class _SixMotors(Plant):
    """Motors behind the gears of the arm: what is the same whatever moves it."""

    def __init__(self, joints_rad: JointVector, model: MotorModel | None) -> None:
        self._gears, self._model = ArmGears(), model or MotorModel()
        self._backlash = _Backlash(self._model.wrist_backlash_rad, joints_rad)
        self._set_points: list[float | None] = [None] * AXES
        self._duty = [0.0] * AXES
        self._motors = list(self._gears.counts(joints_rad))
        self._now_ns: int | None = None

    @override
    def motor_counts(self, axis: int) -> int:
        return round(self._motors[axis])

    def _elapsed_s(self, now_ns: int) -> float:
        elapsed_s = 0.0 if self._now_ns is None else (now_ns - self._now_ns) * _S_PER_NS
        self._now_ns = now_ns
        return elapsed_s


class IdealPlant(_SixMotors):
    """Six motors that follow their servos, with optional lag, load and backlash. Deterministic."""

    def __init__(self, model: MotorModel | None = None) -> None:
        super().__init__(HOME_RAD, model)
        self._jammed = [False] * AXES

    @override
    def set_motor_counts(self, axis: int, counts: float) -> None:
        self._set_points[axis], self._duty[axis] = counts, 0.0
        if self._model.lag_s == 0.0 and not self._jammed[axis]:
            self._motors[axis] = counts + self._model.load_counts[axis]

    @override
    def set_motor_duty(self, axis: int, duty: float) -> None:
        self._set_points[axis], self._duty[axis] = None, duty

    @override
    def advance(self, now_ns: int) -> None:
        elapsed_s, lag_s = self._elapsed_s(now_ns), self._model.lag_s
        share = 1.0 - exp(-elapsed_s / lag_s) if lag_s else 0.0
        for axis in range(AXES):
            if self._jammed[axis]:
                continue
            held = self._set_points[axis]
            if held is None:
                self._motors[axis] += self._duty[axis] * self._model.free_speed_counts_per_s[axis] * elapsed_s
            elif lag_s:
                self._motors[axis] += share * (held + self._model.load_counts[axis] - self._motors[axis])

    def jam(self, axis: int, *, jammed: bool = True) -> None:
        """Block a motor where it is, or let it go."""
        self._jammed[axis] = jammed

    def push(self, axis: int, counts: float) -> None:
        """Displace a motor from outside; a held motor without lag goes back at its next set-point."""
        self._motors[axis] += counts

    def joints_rad(self) -> JointVector:
        """True joint angles, (6,) rad: behind the backlash, which encoders on the motors do not measure."""
        return self._backlash.follow(self._gears.joints_rad(tuple(self._motors)))


class JointPlant(_SixMotors):
    """Motors that drive an arm simulated elsewhere, for instance in MuJoCo.

    Each control tick of that simulation: command its joint servos with `targets_rad()`, step it, and hand its exact
    joint angles to `measured_rad()`. Encoders then show these angles, so between two control ticks they stand still
    while the set-points move on; allow for that in the limit of position error, and note that the modules' velocity
    item has the same steps.

    Args:
        joints_rad: Where the arm is, (6,) rad.
        model: Backlash and open-loop speed; lag and load are those of the simulation and must be zero.
    """

    def __init__(self, joints_rad: JointVector = HOME_RAD, model: MotorModel | None = None) -> None:
        super().__init__(joints_rad, model)
        if self._model.lag_s or any(self._model.load_counts):
            raise ValueError("lag_s and load_counts belong to the simulation behind a JointPlant")
        # Where the motors stand in their backlash, relative to the joints.
        self._play_rad: JointVector = (0.0,) * AXES
        self._driven = list(self._motors)

    @override
    def set_motor_counts(self, axis: int, counts: float) -> None:
        self._set_points[axis], self._duty[axis], self._driven[axis] = counts, 0.0, counts

    @override
    def set_motor_duty(self, axis: int, duty: float) -> None:
        if self._set_points[axis] is not None:
            self._driven[axis] = self._motors[axis]
        self._set_points[axis], self._duty[axis] = None, duty

    @override
    def advance(self, now_ns: int) -> None:
        elapsed_s = self._elapsed_s(now_ns)
        for axis, duty in enumerate(self._duty):
            if duty:
                self._driven[axis] += duty * self._model.free_speed_counts_per_s[axis] * elapsed_s

    def targets_rad(self) -> JointVector:
        """Joint set-points that the motors hold now, (6,) rad.

        A free motor holds where it was released: gears of this ratio do not run backwards (INFERENCE).
        """
        gears_rad = self._gears.joints_rad(tuple(self._driven))
        joints_rad = self._backlash.follow(gears_rad)
        self._play_rad = tuple(gear - joint for gear, joint in zip(gears_rad, joints_rad, strict=True))
        return joints_rad

    def measured_rad(self, joints_rad: JointVector) -> None:
        """Feed back where the joints really are, (6,) rad."""
        gears_rad = tuple(joint + play for joint, play in zip(joints_rad, self._play_rad, strict=True))
        self._motors = list(self._gears.counts(gears_rad))


class DirectMotors:
    """Motors as emulated drives control them, in counts, in front of an arm that another simulation moves in radians.

    Args:
        joints_rad: Where the arm is, (n,) rad; zero counts are angle zero.
    """

    def __init__(self, counts_per_rad: tuple[float, ...], joints_rad: JointVector) -> None:
        self._scale = counts_per_rad
        self._targets = [q * k for q, k in zip(joints_rad, counts_per_rad, strict=True)]
        self._measured = [round(counts) for counts in self._targets]

    def set_motor_counts(self, axis: int, counts: float) -> None:
        """The servo of this axis now holds this position."""
        self._targets[axis] = counts

    def motor_counts(self, axis: int) -> int:
        """What the encoder of this axis counts."""
        return self._measured[axis]

    def advance(self, now_ns: int) -> None:
        """Time passes in the other simulation."""

    def targets_rad(self) -> JointVector:
        """Joint set-points that the motors hold now, (n,) rad."""
        return tuple(counts / k for counts, k in zip(self._targets, self._scale, strict=True))

    def measured_rad(self, joints_rad: JointVector) -> None:
        """Feed back where the joints are, (n,) rad."""
        self._measured = [round(q * k) for q, k in zip(joints_rad, self._scale, strict=True)]
