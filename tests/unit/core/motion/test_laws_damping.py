"""Damping control: yields to force, presses with the nominal force, and is stable for every gain it accepts."""

from __future__ import annotations

from collections import deque
from math import hypot, inf, nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.motion.laws import DampingControl
from palpate.core.ports.values import Vector3

PERIOD_S = 1.0 / 140
ORIGIN: Vector3 = (0.0, 0.0, 0.0)
PRESS: Vector3 = (0.0, 0.0, -5.0)

stiffnesses = st.floats(100.0, 1e5)
margins = st.floats(1.0, 20.0)  # damping in units of the lowest one accepted


def pressed(stiffness: float, margin: float, delay: int, speed: float, ticks: int) -> list[float]:
    """Force along z, tick by tick, while the law presses on a spring; the force arrives some ticks late."""
    law = DampingControl(2 * stiffness * PERIOD_S * margin, PRESS, speed, stiffness, PERIOD_S)
    z, forces = 0.0, []
    sensed = deque([0.0] * delay, maxlen=delay + 1)
    for _ in range(ticks):
        force = -stiffness * max(z, 0.0)
        forces.append(force)
        sensed.append(force)
        _, _, vz = law.velocity_m_s(ORIGIN, ORIGIN, (0.0, 0.0, sensed[0]))
        z += vz * PERIOD_S
    return forces


@settings(deadline=None)
@given(stiffnesses, margins)
def test_pressing_settles_at_the_nominal_force_without_overshoot(stiffness: float, margin: float) -> None:
    forces = pressed(stiffness, margin, delay=0, speed=1.0, ticks=600)
    assert forces[-1] == pytest.approx(-5.0, abs=1e-3)
    assert min(forces) >= -5.0 - 1e-9


@settings(deadline=None)
@given(stiffnesses, margins)
def test_pressing_settles_with_two_ticks_of_lag_and_a_speed_limit(stiffness: float, margin: float) -> None:
    forces = pressed(stiffness, margin, delay=2, speed=0.02, ticks=2000)
    assert max(abs(force + 5.0) for force in forces[-100:]) < 1e-3


@given(stiffnesses, st.floats(0.01, 0.999))
def test_too_little_damping_is_refused_by_name(stiffness: float, share: float) -> None:
    with pytest.raises(ConfigurationError, match="or pressing oscillates") as caught:
        DampingControl(2 * stiffness * PERIOD_S * share, PRESS, 0.02, stiffness, PERIOD_S)
    assert caught.value.field == "control.damping_N_s_per_m"
    assert caught.value.value == 2 * stiffness * PERIOD_S * share


def test_the_refusal_says_what_would_be_accepted() -> None:
    with pytest.raises(ConfigurationError, match=r"at least 71\.43 N s/m"):
        DampingControl(50.0, PRESS, 0.02, 5e3, PERIOD_S)


@pytest.mark.parametrize("damping", [0.0, -400.0, nan, inf])
def test_a_damping_must_be_a_finite_number(damping: float) -> None:
    with pytest.raises(ConfigurationError):
        DampingControl(damping, PRESS, 0.02, 100.0, PERIOD_S)


def test_in_free_space_it_moves_against_the_nominal_force() -> None:
    law = DampingControl(400.0, PRESS, 0.05, 5e3, PERIOD_S)
    assert law.velocity_m_s(ORIGIN, ORIGIN, ORIGIN) == pytest.approx((0.0, 0.0, 0.0125))


def test_it_yields_to_a_push_from_any_side() -> None:
    law = DampingControl(400.0, PRESS, 0.05, 5e3, PERIOD_S)
    assert law.velocity_m_s(ORIGIN, ORIGIN, (2.0, -1.0, -5.0)) == pytest.approx((5e-3, -2.5e-3, 0.0))
    assert law.velocity_m_s(ORIGIN, ORIGIN, (0.0, 0.0, -9.0)) == pytest.approx((0.0, 0.0, -0.01))


def test_the_nominal_force_counts_on_every_axis() -> None:
    law = DampingControl(400.0, (1.0, -2.0, -5.0), 1.0, 5e3, PERIOD_S)
    assert law.velocity_m_s(ORIGIN, ORIGIN, (3.0, 3.0, 3.0)) == pytest.approx((5e-3, 12.5e-3, 20e-3))


def test_the_speed_limit_keeps_the_direction() -> None:
    law = DampingControl(100.0, ORIGIN, 0.01, 5e3, PERIOD_S)
    velocity = law.velocity_m_s(ORIGIN, ORIGIN, (3.0, 0.0, -4.0))
    assert hypot(*velocity) == pytest.approx(0.01)
    assert velocity == pytest.approx((0.006, 0.0, -0.008))


def test_positions_and_the_past_do_not_matter() -> None:
    law = DampingControl(400.0, PRESS, 0.05, 5e3, PERIOD_S)
    first = law.velocity_m_s(ORIGIN, ORIGIN, (1.0, 2.0, -3.0))
    law.velocity_m_s(ORIGIN, ORIGIN, (-9.0, 0.0, 30.0))
    law.reset()
    assert law.velocity_m_s((1.0, 2.0, 3.0), (-4.0, 5.0, 6.0), (1.0, 2.0, -3.0)) == first


@pytest.mark.parametrize("speed", [0.0, 1.5, nan])
def test_a_speed_limit_must_make_sense(speed: float) -> None:
    with pytest.raises(ConfigurationError) as caught:
        DampingControl(400.0, PRESS, speed, 5e3, PERIOD_S)
    assert caught.value.field == "control.speed_limit_m_s"
