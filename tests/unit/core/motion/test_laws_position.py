"""Position control: goes to the target, no faster than allowed, and never past it."""

from __future__ import annotations

from math import hypot, inf, nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.motion.laws import PositionControl
from palpate.core.ports.values import Vector3

PERIOD_S = 1.0 / 140
NO_FORCE: Vector3 = (0.0, 0.0, 0.0)


@settings(deadline=None)
@given(gain=st.floats(1.0, 140.0), speed=st.floats(1e-3, 0.1), distance=st.floats(-5e-3, 5e-3))
def test_it_arrives_without_overshoot_for_every_accepted_gain(gain: float, speed: float, distance: float) -> None:
    law = PositionControl(gain, speed, PERIOD_S)
    x = 0.0
    for _ in range(4000):
        vx, _, _ = law.velocity_m_s((x, 0.0, 0.0), (distance, 0.0, 0.0), NO_FORCE)
        before = abs(distance - x)
        x += vx * PERIOD_S
        assert abs(distance - x) <= before
        assert (distance - x) * distance >= -1e-18  # never past it
    assert x == pytest.approx(distance, abs=1e-9)


def test_the_way_to_a_far_target_is_straight() -> None:
    law = PositionControl(70.0, 0.02, PERIOD_S)
    velocity = law.velocity_m_s((0.001, -0.002, -0.003), (0.031, 0.038, -0.003), NO_FORCE)
    assert hypot(*velocity) == pytest.approx(0.02)
    assert velocity == pytest.approx((0.012, 0.016, 0.0))


def test_near_the_target_speed_is_gain_times_distance() -> None:
    law = PositionControl(50.0, 0.1, PERIOD_S)
    velocity = law.velocity_m_s((0.0, 0.0, 0.0), (1e-4, -2e-4, 0.0), NO_FORCE)
    assert velocity == pytest.approx((5e-3, -1e-2, 0.0))


def test_forces_do_not_matter() -> None:
    law = PositionControl(50.0, 0.1, PERIOD_S)
    reference, target = (0.0, 0.0, 0.0), (1e-3, 2e-3, 3e-3)
    free = law.velocity_m_s(reference, target, NO_FORCE)
    law.reset()
    assert law.velocity_m_s(reference, target, (9.0, -9.0, 30.0)) == free


@pytest.mark.parametrize("gain", [140.1, 280.0, 0.0, -1.0, nan, inf])
def test_an_unstable_gain_is_refused_by_name(gain: float) -> None:
    with pytest.raises(ConfigurationError, match=r"from 0\.001 to 140") as caught:
        PositionControl(gain, 0.02, PERIOD_S)
    assert caught.value.field == "control.position_gain_per_s"


def test_the_highest_gain_arrives_in_one_tick() -> None:
    law = PositionControl(140.0, 1.0, PERIOD_S)
    vx, _, _ = law.velocity_m_s((0.0, 0.0, 0.0), (1e-3, 0.0, 0.0), NO_FORCE)
    assert vx * PERIOD_S == pytest.approx(1e-3)


@pytest.mark.parametrize("speed", [0.0, -0.1, 1.1, nan])
def test_a_speed_limit_must_make_sense(speed: float) -> None:
    with pytest.raises(ConfigurationError) as caught:
        PositionControl(70.0, speed, PERIOD_S)
    assert caught.value.field == "control.speed_limit_m_s"
