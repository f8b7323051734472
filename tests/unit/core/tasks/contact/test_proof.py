"""What no contact at the tip can give, and the trips of a proof that fails."""

from math import cos, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.motion import Array
from palpate.core.ports.values import JointSample, Snapshot, WrenchSample
from palpate.core.tasks.contact.proof import ContactProof
from palpate.core.trial import ControlConfig, TaskConfig, TrialSetup, Trip, TripReason
from tests.unit.core.fake_world import TOOL, measurement, ready_pose

LEVER_M = TOOL.tip_m[2]
ANGLES, _ = ready_pose()


class Held:
    """Samples held against what a contact can give, one by one."""

    def __init__(self) -> None:
        self.measurement = measurement()
        self.proof = ContactProof(TaskConfig(), ControlConfig())
        self.proof.begin(TrialSetup(0, 0, (0.0, 0.0)))
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
