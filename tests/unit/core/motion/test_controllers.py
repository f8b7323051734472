"""Motion laws: each stable for every gain that it accepts, limited in speed, and undisturbed by its neighbour."""

from collections import deque
from math import hypot, inf, nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.motion.controllers import (
    Controller,
    DampingControl,
    ForceControl,
    HybridControl,
    PositionControl,
    limited,
)

PERIOD_S = 1.0 / 140
ORIGIN = (0.0, 0.0, 0.0)
PRESS = (0.0, 0.0, -5.0)
stiffnesses = st.floats(100.0, 1e5)
components = st.floats(-10.0, 10.0)


def position(gain=50.0, speed=0.1):
    return PositionControl(gain, speed, PERIOD_S)


def damping(damping=400.0, nominal=PRESS, speed=0.05, k=5e3):
    return DampingControl(damping, nominal, speed, k, PERIOD_S)


def force(integral=1e-3, proportional=0.0, target=ORIGIN, speed=1.0, k=1e4):
    return ForceControl(integral, proportional, target, speed, k, PERIOD_S)


def refuse(field, controller, **gains):
    """The words with which a law refuses a gain, by its name."""
    with pytest.raises(ConfigurationError) as caught:
        controller(**gains)
    assert caught.value.field == f"control.{field}"
    assert caught.value.value in gains.values() or nan in gains.values()
    return str(caught.value)


# The speed limit that all laws share.


@given(st.tuples(components, components, components), st.floats(1e-6, 1.0))
def test_velocity_is_shortened_and_keeps_its_direction(velocity, limit):
    speed = hypot(*velocity)
    result = limited(velocity, limit)
    if speed <= limit * (1 - 1e-12):
        assert result is velocity
    else:
        assert hypot(*result) == pytest.approx(min(speed, limit), rel=1e-12)
        assert result == pytest.approx([v * min(limit / speed, 1.0) for v in velocity], rel=1e-9, abs=1e-15)


@pytest.mark.parametrize(
    ("controller", "target", "force_N"),
    [
        (position(speed=0.01), (0.3, 0.0, -0.4), ORIGIN),
        (damping(100.0, ORIGIN, 0.01), ORIGIN, (3.0, 0.0, -4.0)),
        (force(speed=0.01), ORIGIN, (30.0, 0.0, -40.0)),
    ],
)
def test_every_law_keeps_it(controller, target, force_N):
    assert controller.velocity_m_s(ORIGIN, target, force_N) == pytest.approx((0.006, 0.0, -0.008))


# Position control goes to the target and never past it.


@settings(deadline=None)
@given(gain=st.floats(1.0, 140.0), speed=st.floats(1e-3, 0.1), distance=st.floats(-5e-3, 5e-3))
def test_it_arrives_without_overshoot_for_every_accepted_gain(gain, speed, distance):
    controller = position(gain, speed)
    x = 0.0
    for _ in range(4000):
        vx, _, _ = controller.velocity_m_s((x, 0.0, 0.0), (distance, 0.0, 0.0), ORIGIN)
        before = abs(distance - x)
        x += vx * PERIOD_S
        assert abs(distance - x) <= before
        assert (distance - x) * distance >= -1e-18  # never past it
    assert x == pytest.approx(distance, abs=1e-9)


# Damping control yields to force and presses with the nominal force.


margins = st.floats(1.0, 20.0)  # damping in units of the lowest one accepted


def pressed(stiffness, margin, delay, speed, ticks):
    """Force along z, tick by tick, while the law presses on a spring; the force arrives some ticks late."""
    controller = damping(2 * stiffness * PERIOD_S * margin, speed=speed, k=stiffness)
    z, forces = 0.0, []
    sensed = deque([0.0] * delay, maxlen=delay + 1)
    for _ in range(ticks):
        forces.append(-stiffness * max(z, 0.0))
        sensed.append(forces[-1])
        _, _, vz = controller.velocity_m_s(ORIGIN, ORIGIN, (0.0, 0.0, sensed[0]))
        z += vz * PERIOD_S
    return forces


@settings(deadline=None)
@given(stiffnesses, margins)
def test_pressing_settles_at_the_nominal_force_without_overshoot(stiffness, margin):
    forces = pressed(stiffness, margin, delay=0, speed=1.0, ticks=600)
    assert forces[-1] == pytest.approx(-5.0, abs=1e-3)
    assert min(forces) >= -5.0 - 1e-9


# Force control holds its force on every contact that it was tuned for.


TARGET = (2.0, 0.0, 0.0)


def highest_integral(stiffness, proportional):
    return (1.0 - stiffness * proportional) / (stiffness * PERIOD_S)


def on_a_spring(controller, stiffness, ticks, delay=0):
    """Force along x, tick by tick, of a tip that starts 7 N away from the target."""
    x, forces = 5.0 / stiffness, []
    sensed = deque([-5.0] * delay, maxlen=delay + 1)
    for _ in range(ticks):
        forces.append(-stiffness * x)
        sensed.append(forces[-1])
        vx, _, _ = controller.velocity_m_s(ORIGIN, ORIGIN, (sensed[0], 0.0, 0.0))
        x += vx * PERIOD_S
    return forces


@settings(deadline=None)
@given(stiffness=stiffnesses, p=st.floats(0.0, 1.0), i=st.floats(0.05, 1.0))
def test_force_settles_for_every_accepted_gain(stiffness, p, i):
    proportional = 0.5 * p / stiffness
    integral = i * highest_integral(stiffness, proportional)
    controller = force(integral, proportional, TARGET, k=stiffness)
    forces = on_a_spring(controller, stiffness, 900)
    assert max(abs(f - 2.0) for f in forces[-20:]) < 1e-3
    assert max(abs(f - 2.0) for f in forces) <= 7.0 * (1 + 1e-9)  # never farther than at first


@given(stiffness=stiffnesses, p=st.floats(0.0, 1.0), excess=st.floats(1.001, 10.0))
def test_too_much_integral_gain_is_refused_by_name(stiffness, p, excess):
    proportional = 0.5 * p / stiffness
    integral = excess * highest_integral(stiffness, proportional)
    gains = {"integral": integral, "proportional": proportional, "k": stiffness}
    assert "or the contact oscillates" in refuse("force_integral_m_per_N_s", force, **gains)


@pytest.mark.parametrize(
    ("controller", "gains", "field", "said"),
    [
        *(
            (controller, {"speed": speed}, "speed_limit_m_s", "")
            for controller in (position, damping, force)
            for speed in (0.0, 1.1, nan)
        ),
        *((position, {"gain": gain}, "position_gain_per_s", "from 0.001 to 140") for gain in (140.1, 0.0, nan)),
        *((damping, {"damping": gain}, "damping_N_s_per_m", "at least 71.43 N s/m") for gain in (0.0, nan, inf, 71.42)),
        *(
            (force, {"integral": gain, "k": 4e4}, "force_integral_m_per_N_s", "above 0 and at most 0.0035 m/")
            for gain in (0.0, nan, inf)
        ),
        *(
            (force, {"integral": 1e-5, "proportional": gain, "k": 4e4}, "force_proportional_m_per_N", "")
            for gain in (-1e-9, 0.51 / 4e4, nan)
        ),
    ],
)
def test_gain_that_is_unstable_or_none_is_refused_by_name(controller, gains, field, said):
    assert said in refuse(field, controller, **gains)


def test_new_contact_does_not_begin_with_a_kick():
    controller = force(1e-5, 1e-5)
    fresh = controller.velocity_m_s(ORIGIN, ORIGIN, (10.0, 0.0, 0.0))
    assert fresh == pytest.approx((1e-4, 0.0, 0.0))
    kicked = controller.velocity_m_s(ORIGIN, ORIGIN, (-10.0, 0.0, 0.0))
    assert abs(kicked[0]) > 100 * abs(fresh[0])
    controller.reset()
    assert controller.velocity_m_s(ORIGIN, ORIGIN, (10.0, 0.0, 0.0)) == fresh


def test_each_of_two_controllers_sees_its_own_axes_only():
    seen = []

    class Seen(Controller):
        def velocity_m_s(self, *vectors):
            seen.append(vectors)
            return 1.0, 2.0, 3.0

    both = HybridControl(Seen(), Seen())
    assert both.velocity_m_s((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (7.0, 8.0, 9.0)) == (1.0, 2.0, 3.0)
    across, along = seen
    assert across == ((1.0, 2.0, 0.0), (4.0, 5.0, 0.0), (7.0, 8.0, 0.0))
    assert along == ((0.0, 0.0, 3.0), (0.0, 0.0, 6.0), (0.0, 0.0, 9.0))
