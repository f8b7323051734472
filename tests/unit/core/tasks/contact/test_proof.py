"""What no contact at the tip can give, and the trips of a proof that fails."""

from math import cos, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.motion import Array, Kinematics, arm_named
from palpate.core.perception import SignalProcessor
from palpate.core.ports.values import CONTROL_RATE_HZ, JointSample, Snapshot, WrenchSample
from palpate.core.tasks.contact.proof import ContactProof
from palpate.core.trial import ControlConfig, Measurement, TaskConfig, Trip, TripReason, goal_in_base
from palpate.core.trial.config import GoalConfig
from tests.unit.core.fake_world import TOOL, ready_pose

LEVER_M = TOOL.tip_from_sensor_m
ANGLES, _ = ready_pose()


class Held:
    """Samples held against what a contact can give, one by one."""

    def __init__(self) -> None:
        signal = SignalProcessor(CONTROL_RATE_HZ, 4.0)
        self.measurement = Measurement(Kinematics(arm_named("zebra-zero"), TOOL), goal_in_base(GoalConfig()), signal)
        self.proof = ContactProof(TaskConfig(), ControlConfig())
        self._tick = self._sequence = 0

    def sample(self, wrench: Array, *, repeated: bool = False, tared: bool = True) -> Trip | None:
        """The next tick, with a wrench in the sensor's frame."""
        self._tick += 1
        self._sequence += not repeated
        a, b, c, d, e, f = wrench.tolist()
        sample = WrenchSample((a, b, c), (d, e, f), 0, 0, self._sequence)
        snapshot = Snapshot(self._tick, 0, sample, JointSample(ANGLES, 0, 0, self._tick))
        self.measurement.update(snapshot)
        return self.proof.contradiction(snapshot, self.measurement, tared=tared)


def at_tip(force: tuple[float, float, float], point_m: tuple[float, float] = (0.0, 0.0)) -> Array:
    """The wrench at the sensor of a force on the tip, so far from its centre; sensor frame."""
    return np.array([*force, *np.cross((*point_m, LEVER_M), force)])


PULL = at_tip((0.0, 0.0, 2.6))
"""More than half the pressing force of 4.9 N."""
ACROSS = at_tip((6.0, 0.0, -4.9))
SWAPPED = ACROSS[[1, 0, 2, 3, 4, 5]]


@pytest.mark.parametrize(("wrench", "reason"), [(PULL, "PULLED"), (SWAPPED, "TORQUE_WITHOUT_FORCE")])
def test_a_contradiction_counts_after_four_new_samples_in_a_row(wrench: Array, reason: str) -> None:
    held = Held()
    for _ in range(3):
        assert held.sample(wrench) is None
    assert held.sample(wrench, repeated=True) is None
    assert held.sample(0.0 * wrench) is None
    for _ in range(3):
        assert held.sample(wrench) is None
    trip = held.sample(wrench)
    assert trip is not None
    assert trip.reason is TripReason[reason]


@pytest.mark.parametrize("reason", ["PULLED", "TORQUE_WITHOUT_FORCE"])
def test_another_trial_starts_from_nothing(reason: str) -> None:
    wrench = PULL if reason == "PULLED" else SWAPPED
    held = Held()
    for _ in range(4):
        trip = held.sample(wrench)
    assert trip is not None
    held.proof.begin()
    assert held.sample(wrench) is None


def test_nothing_is_a_contradiction_before_the_sensor_is_tared() -> None:
    held = Held()
    assert all(held.sample(PULL, tared=False) is None for _ in range(10))


def test_a_peg_that_rebounds_is_no_pull() -> None:
    held = Held()
    assert all(held.sample(at_tip((0.0, 0.0, 2.3))) is None for _ in range(20))


@given(st.floats(0.0, 40.0), st.floats(-3.2, 3.2), st.floats(0.0, 0.02), st.floats(-3.2, 3.2))
def test_no_force_on_the_tip_is_a_contradiction(size_N: float, heading: float, off_m: float, side: float) -> None:
    """Pressed at any place of a tip of 20 mm radius, with friction of 0.6."""
    across_N = 0.6 * size_N
    force = (across_N * cos(heading), across_N * sin(heading), -size_N)
    held = Held()
    assert all(held.sample(at_tip(force, (off_m * cos(side), off_m * sin(side)))) is None for _ in range(6))


@pytest.mark.parametrize("noise_N", [0.1, 0.3])
def test_noise_is_none_either(noise_N: float) -> None:
    held, rng = Held(), np.random.default_rng(4)
    noise = noise_N * np.array([1.0, 1.0, 1.0, 0.04, 0.04, 0.04])
    assert all(held.sample(ACROSS + noise * rng.standard_normal(6)) is None for _ in range(500))


@pytest.mark.parametrize("noise_N", [0.0, 0.1])
@pytest.mark.parametrize("dead", [[0], [4], [0, 1, 2]])
def test_a_dead_channel_is_a_contradiction_under_a_lateral_force(dead: list[int], noise_N: float) -> None:
    held, rng = Held(), np.random.default_rng(4)
    noise = noise_N * np.array([1.0, 1.0, 1.0, 0.04, 0.04, 0.04])
    wrench = at_tip((10.0, 0.0, -4.9))
    wrench[dead] = 0.0
    trips = [held.sample(wrench + noise * rng.standard_normal(6)) for _ in range(10)]
    assert {trip.reason for trip in trips if trip is not None} == {TripReason.TORQUE_WITHOUT_FORCE}


def test_a_spring_out_of_bounds_is_told_as_a_share_of_the_right_one() -> None:
    proof = Held().proof
    proof.axial.share = 0.2
    trip = proof.no_spring(7)
    assert (trip.reason, trip.tick) == (TripReason.FORCE_WITHOUT_SPRING, 7)
    assert "with 0.20 of control.axial_stiffness_N_per_mm, 0.65 to 1.5 are right" in trip.text


def test_the_trips_hold_lengths_in_mm_and_forces_in_N() -> None:
    proof = Held().proof
    proof.wall.begin((0.0, 0.0, 0.0))
    past, soft, plate, above, wall = (
        proof.no_floor(1, 0.0110, 0.0105),
        proof.floor_too_soft(1, 2.0, 3.4),
        proof.no_plate(1, 0.002, 0.0015),
        proof.above_plate(1, 0.0007),
        proof.no_wall(1, 0.001),
    )
    assert "is 11.00 mm deep, where the floor must be above 10.50 mm" in past.text
    assert "with 2.00 N, 3.40 N needed" in soft.text
    assert "down to 2.00 mm below the nominal plane, where the plate must be above 1.50 mm" in plate.text
    assert "contact 0.70 mm above" in above.text
    assert "at 1.00 mm depth (0.00 N, 1.2 N needed)" in wall.text
    assert [trip.reason.name for trip in (past, soft, plate, above, wall)] == [
        "FORCE_WITHOUT_SPRING",
        "FORCE_WITHOUT_SPRING",
        "PLATE_NOT_FELT",
        "FORCE_WITHOUT_SPRING",
        "WALL_NOT_FELT",
    ]
