"""The account of whether the force that is measured is the force that there is."""

from abc import abstractmethod
from collections.abc import Sequence
from typing import Final, Protocol

from typing_extensions import override

from palpate.core.motion import TipMotion
from palpate.core.ports import CONTROL_RATE_HZ, Snapshot
from palpate.core.tasks.contact.axial_check import HIGHEST_SHARE, LOWEST_SHARE, AxialCheck
from palpate.core.tasks.contact.both_walls import FOLLOWED_N
from palpate.core.tasks.contact.first_touch import FirstTouch
from palpate.core.tasks.contact.sign_of_life import SignOfLife
from palpate.core.tasks.contact.trial_state import TrialState
from palpate.core.tasks.contact.wall_check import ANSWER_N, WallCheck
from palpate.core.trial import (
    N_PER_KGF,
    ControlConfig,
    Measurement,
    Purpose,
    TaskConfig,
    TrialSetup,
    Trip,
    TripReason,
    generator,
)

PAST_PLATE_M: Final = 1e-3
"""A tip so far below where the plate must be is in the hole, or its sensor is dead."""
_SWING_SHARE: Final = 0.25
"""At most so much of the pressing force comes and goes with a heave."""
_PULL_SHARE: Final = 0.5
"""A pull above this share of the pressing force is none of the plate's; a peg that drops rebounds with less."""
_SAMPLES: Final = 4
"""Consecutive samples that a contradiction has to last."""
_TORQUE_NM: Final = 0.3
"""Torque about the tip that a leaning peg in a hole gives; 0.25 N m was the most at 20 mrad of tilt."""
_ARM_M: Final = 0.06
"""Largest radius of a tip: a force there has this lever about the tip's centre."""


class Proof(Protocol):
    """What is asked of proofs of contact in every trial, with or without them.

    Attributes:
        deepest_plate_m: A tip that is deeper below the nominal plane has to be in the hole.
    """

    deepest_plate_m: float

    @abstractmethod
    def begin(self, setup: TrialSetup) -> None:
        """A trial begins."""

    @abstractmethod
    def watch_touch(self, snapshot: Snapshot, measured: Measurement) -> None:
        """A tick of the approach or of the rest after it."""

    @abstractmethod
    def contradiction(self, snapshot: Snapshot, measured: Measurement, *, tared: bool) -> Trip | None:
        """A tick of any phase, after the measurement's update.

        Returns:
            What no contact at the tip can give, in several samples in a row; None if there is nothing of the kind.
        """


class ContactProof(Proof):
    """What a trial holds force against position with, from the first touch to the floor of the hole.

    Args:
        task: Pressing force, play of the hole.

    Attributes:
        life: Travel since the sensor's last sign of life.
    """

    def __init__(self, task: TaskConfig, control: ControlConfig) -> None:
        stiffness_N_per_m, press_N = control.axial_stiffness_N_per_mm * 1e3, task.press_kgf * N_PER_KGF
        self._pull_N = _PULL_SHARE * press_N
        self.deepest_plate_m = task.surface_uncertainty_mm * 1e-3 + PAST_PLATE_M
        self.touch = FirstTouch(stiffness_N_per_m, press_N)
        speed_m_s = task.travel_speed_mm_s * 1e-3
        # Neither does a heave lose contact, nor comes it near the force limit.
        room_N = min(press_N - task.contact_kgf * N_PER_KGF, task.max_force_N - press_N)
        swing_N = min(_SWING_SHARE * press_N, 0.5 * room_N)
        self.life = SignOfLife(stiffness_N_per_m, swing_N, speed_m_s)
        self.axial = AxialCheck(stiffness_N_per_m, press_N, speed_m_s, 1.0 / CONTROL_RATE_HZ)
        self.wall = WallCheck(task.reach_m)

    @override
    def begin(self, setup: TrialSetup) -> None:
        self.touch.begin()
        self.life.begin(generator(setup.seed, Purpose.SLIDE, setup.index))
        self.new: bool
        self._sequence: int | None = None
        self._pulls = self._misfits = 0
        self._torque_Nm: float
        self._torque_limit_Nm: float

    @override
    def watch_touch(self, snapshot: Snapshot, measured: Measurement) -> None:
        self.touch.watch(snapshot, measured.force_N[2], measured.position_m[2])

    @override
    def contradiction(self, snapshot: Snapshot, measured: Measurement, *, tared: bool) -> Trip | None:
        tick, sequence = snapshot.tick, snapshot.wrench.sequence
        self.new, self._sequence = sequence != self._sequence, sequence
        if not tared:
            return None
        if self.new:
            self._pulls = self._pulls + 1 if measured.force_N[2] > self._pull_N else 0
            self._torque_Nm = measured.torque_across_at_tip_Nm
            self._torque_limit_Nm = _TORQUE_NM + _ARM_M * measured.force_norm_N
            self._misfits = self._misfits + 1 if self._torque_Nm > self._torque_limit_Nm else 0
        if self._pulls >= _SAMPLES:
            pull_N = measured.force_N[2]
            text = f"the force sensor shows a pull of {pull_N:.2f} N where the tool can only be pushed"
            return Trip(TripReason.PULLED, tick, text)
        if self._misfits >= _SAMPLES:
            torque_Nm, limit_Nm = self._torque_Nm, self._torque_limit_Nm
            text = (
                f"torque about the tip {torque_Nm:.3f} N m, at most {limit_Nm:.3f} N m with this force:"
                " a channel of the force sensor is dead, swapped or wrong"
            )
            return Trip(TripReason.TORQUE_WITHOUT_FORCE, tick, text)
        return None

    def no_plate(self, tick: int, depth_m: float, limit_m: float) -> Trip:
        """Nothing was felt down to where the plate must be, and no wall answered."""
        text = (
            f"nothing felt down to {depth_m * 1e3:.2f} mm below the nominal plane, where the plate must be above"
            f" {limit_m * 1e3:.2f} mm, and no wall of the hole answers: the plate is elsewhere, or the force sensor is"
            " dead"
        )
        return Trip(TripReason.PLATE_NOT_FELT, tick, text)

    def above_plate(self, tick: int, rise_m: float) -> Trip:
        """The sensor shows the plate's reaction where the tip is above it."""
        text = f"the force sensor shows contact {rise_m * 1e3:.2f} mm above the plate that was touched"
        return Trip(TripReason.CONTACT_MISMATCH, tick, text)

    def led_back(self, tick: int) -> Trip:
        """The peg was in the hole, and the force leads it out again."""
        text = "the force leads the peg back out of the hole from where it stood: it is not the hole's"
        return Trip(TripReason.CONTACT_MISMATCH, tick, text)

    def no_wall(self, tick: int, depth_m: float) -> Trip:
        """The peg should be in the hole, and no wall answered."""
        text = (
            f"no wall answers a push at {depth_m * 1e3:.2f} mm depth ({self.wall.answer_N:.2f} N, {ANSWER_N:g} N"
            " needed): the peg is not in the hole, the hole is wider than task.play_mm, or the force sensor does not"
            " show what there is"
        )
        return Trip(TripReason.WALL_NOT_FELT, tick, text)

    def no_walls(self, tick: int, depth_m: float, forces_N: Sequence[float]) -> Trip:
        """At full depth, without a floor, the lateral force does not follow pushes to and fro."""
        told = ", ".join(f"{force_N:.2f} N" for force_N in forces_N) or "nothing"
        text = (
            f"pushed from wall to wall at {depth_m * 1e3:.2f} mm depth the sensor shows {told}, which is not"
            f" {FOLLOWED_N:g} N more at the other wall, steady, and the same again on the way back: the peg is not in"
            " the hole, the hole is wider than task.play_mm, or the force sensor does not show what there is"
        )
        return Trip(TripReason.WALL_NOT_FELT, tick, text)

    def no_depth(self, tick: int, depth_m: float, least_m: float) -> Trip:
        """The tip seemed deep enough, and is not while walls are pushed."""
        text = (
            f"the tip was at full depth without a floor, and is at {depth_m * 1e3:.2f} mm, {least_m * 1e3:.2f} mm"
            " needed, while nothing moves it along: the force along the axis is not what there is"
        )
        return Trip(TripReason.CONTACT_MISMATCH, tick, text)

    def drifts(self, tick: int, depth_m: float, change_N: float, limit_N: float) -> Trip:
        """The tip sank without the plate's force going, and at rest the force changes by itself."""
        text = (
            f"the force changes by {change_N:+.2f} N in half a second while the tool stands still at"
            f" {depth_m * 1e3:.2f} mm, at most {limit_N:g} N is right: the force sensor drifts"
        )
        return Trip(TripReason.CONTACT_MISMATCH, tick, text)

    def no_floor(self, tick: int, depth_m: float, limit_m: float) -> Trip:
        """The tip went past the floor that it seemed to touch."""
        text = (
            f"the tip is {depth_m * 1e3:.2f} mm deep, where the floor must be above {limit_m * 1e3:.2f} mm, and the"
            " force does not grow: nothing is there"
        )
        return Trip(TripReason.CONTACT_MISMATCH, tick, text)

    def floor_too_soft(self, tick: int, press_N: float, needed_N: float) -> Trip:
        """No lift could be made on the floor in the time for it."""
        text = (
            f"the floor bore no lift in time: it pushes back with {press_N:.2f} N, {needed_N:.2f} N needed;"
            " friction carries the rest, or the force sensor is wrong"
        )
        return Trip(TripReason.CONTACT_MISMATCH, tick, text)

    def no_spring(self, tick: int) -> Trip:
        """A lift did not change the force as the gripper's spring does."""
        share = self.axial.share or 0.0
        text = (
            f"the force follows a lift with {share:.2f} of control.axial_stiffness_N_per_mm, {LOWEST_SHARE:g} to"
            f" {HIGHEST_SHARE:g} are right: the force sensor does not show what there is, or the gripper is another one"
        )
        return Trip(TripReason.CONTACT_MISMATCH, tick, text)


class LiftCheck:
    """Lifts a tool that presses, by a little, and doubts the force sensor where the force does not follow.

    Attributes:
        running: Whether it has begun and is not over; the phase that lifts sets it as it is entered.
    """

    def __init__(self, state: TrialState, measurement: Measurement, motion: TipMotion, proof: ContactProof) -> None:
        self._state, self._measurement, self._motion = state, measurement, motion
        self._proof = proof
        self.running: bool

    def begin(self) -> None:
        """The next :meth:`velocity_m_s` is the first of a lift."""
        self.running = True
        self._proof.axial.begin()

    def velocity_m_s(self) -> float | None:
        """Velocity along the tool axis for this tick; None when it is over, with a doubt where it failed."""
        proof, measured = self._proof, self._measurement
        along = proof.axial.velocity_m_s(
            measured.force_N[2], proof.new, self._motion.reference_m[2], measured.position_m[2]
        )
        if along is None:
            self.running = False
            if proof.axial.share is not None and not proof.axial.passed:
                self._state.doubt(proof.no_spring(self._state.tick))
        return along
