"""Force control: holds its force on every contact it was tuned for, and starts a new one without a kick."""

from __future__ import annotations

from collections import deque
from math import hypot, inf, nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.motion.laws import ForceControl
from palpate.core.ports.values import Vector3

PERIOD_S = 1.0 / 140
ORIGIN: Vector3 = (0.0, 0.0, 0.0)
TARGET: Vector3 = (2.0, 0.0, 0.0)

stiffnesses = st.floats(100.0, 1e5)


def highest_integral(stiffness: float, proportional: float) -> float:
    return (1.0 - stiffness * proportional) / (stiffness * PERIOD_S)


def on_a_spring(law: ForceControl, stiffness: float, ticks: int, delay: int = 0) -> list[float]:
    """Force along x, tick by tick, of a tip that starts 7 N away from the target."""
    x, forces = 5.0 / stiffness, []
    sensed = deque([-5.0] * delay, maxlen=delay + 1)
    for _ in range(ticks):
        forces.append(-stiffness * x)
        sensed.append(forces[-1])
        vx, _, _ = law.velocity_m_s(ORIGIN, ORIGIN, (sensed[0], 0.0, 0.0))
        x += vx * PERIOD_S
    return forces


@settings(deadline=None)
@given(stiffness=stiffnesses, p=st.floats(0.0, 1.0), i=st.floats(0.05, 1.0))
def test_the_force_settles_for_every_accepted_gain(stiffness: float, p: float, i: float) -> None:
    proportional = 0.5 * p / stiffness
    integral = i * highest_integral(stiffness, proportional)
    law = ForceControl(integral, proportional, TARGET, 1.0, stiffness, PERIOD_S)
    forces = on_a_spring(law, stiffness, 900)
    assert max(abs(force - 2.0) for force in forces[-20:]) < 1e-3
    assert max(abs(force - 2.0) for force in forces) <= 7.0 * (1 + 1e-9)  # never farther than at first


@settings(deadline=None)
@given(stiffness=stiffnesses, i=st.floats(0.05, 0.5))
def test_the_force_settles_with_a_tick_of_lag_and_a_speed_limit(stiffness: float, i: float) -> None:
    law = ForceControl(i * highest_integral(stiffness, 0.0), 0.0, TARGET, 5e-3, stiffness, PERIOD_S)
    forces = on_a_spring(law, stiffness, 4000, delay=1)
    assert max(abs(force - 2.0) for force in forces[-100:]) < 1e-3


@given(stiffness=stiffnesses, p=st.floats(0.0, 1.0), excess=st.floats(1.001, 10.0))
def test_too_much_integral_gain_is_refused_by_name(stiffness: float, p: float, excess: float) -> None:
    proportional = 0.5 * p / stiffness
    integral = excess * highest_integral(stiffness, proportional)
    with pytest.raises(ConfigurationError, match="or the contact oscillates") as caught:
        ForceControl(integral, proportional, TARGET, 1.0, stiffness, PERIOD_S)
    assert (caught.value.field, caught.value.value) == ("control.force_integral_m_per_N_s", integral)


@pytest.mark.parametrize("integral", [0.0, -1e-4, nan, inf])
def test_an_integral_gain_must_be_a_positive_number(integral: float) -> None:
    with pytest.raises(ConfigurationError, match=r"above 0 and at most 0\.0035 m/"):
        ForceControl(integral, 0.0, TARGET, 1.0, 4e4, PERIOD_S)


@pytest.mark.parametrize("proportional", [-1e-9, 0.51 / 4e4, nan])
def test_too_much_proportional_gain_is_refused_by_name(proportional: float) -> None:
    with pytest.raises(ConfigurationError) as caught:
        ForceControl(1e-5, proportional, TARGET, 1.0, 4e4, PERIOD_S)
    assert caught.value.field == "control.force_proportional_m_per_N"


def test_a_speed_limit_must_make_sense() -> None:
    with pytest.raises(ConfigurationError) as caught:
        ForceControl(1e-5, 0.0, TARGET, 0.0, 4e4, PERIOD_S)
    assert caught.value.field == "control.speed_limit_m_s"


def test_it_yields_to_the_force_beyond_the_target_on_every_axis() -> None:
    law = ForceControl(1e-3, 0.0, (2.0, 1.0, -5.0), 1.0, 1e4, PERIOD_S)
    assert law.velocity_m_s(ORIGIN, ORIGIN, (5.0, -1.0, -9.0)) == pytest.approx((3e-3, -2e-3, -4e-3))


def test_the_speed_limit_keeps_the_direction() -> None:
    law = ForceControl(1e-3, 0.0, ORIGIN, 5e-3, 1e4, PERIOD_S)
    velocity = law.velocity_m_s(ORIGIN, ORIGIN, (30.0, -40.0, 0.0))
    assert hypot(*velocity) == pytest.approx(5e-3)
    assert velocity == pytest.approx((3e-3, -4e-3, 0.0))


def test_the_proportional_part_answers_the_change() -> None:
    p = 1e-5
    law = ForceControl(1e-9, p, ORIGIN, 1.0, 1e4, PERIOD_S)
    law.velocity_m_s(ORIGIN, ORIGIN, (1.0, 2.0, 3.0))
    velocity = law.velocity_m_s(ORIGIN, ORIGIN, (4.0, 1.0, 5.0))
    assert [v * PERIOD_S for v in velocity] == pytest.approx([3.0 * p, -1.0 * p, 2.0 * p], rel=1e-3)


def test_a_new_contact_does_not_begin_with_a_kick() -> None:
    law = ForceControl(1e-5, 1e-5, ORIGIN, 1.0, 1e4, PERIOD_S)
    fresh = law.velocity_m_s(ORIGIN, ORIGIN, (10.0, 0.0, 0.0))
    assert fresh == pytest.approx((1e-4, 0.0, 0.0))
    kicked = law.velocity_m_s(ORIGIN, ORIGIN, (-10.0, 0.0, 0.0))
    assert abs(kicked[0]) > 100 * abs(fresh[0])
    law.reset()
    assert law.velocity_m_s(ORIGIN, ORIGIN, (10.0, 0.0, 0.0)) == fresh
