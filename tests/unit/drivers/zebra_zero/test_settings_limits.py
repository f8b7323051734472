from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.device import AppliedReason
from palpate.drivers.errors import RefusedError, SettingError
from palpate.drivers.zebra_zero.counts import HOME_RAD
from palpate.drivers.zebra_zero.settings import JointLimits
from tests.unit.drivers.zebra_zero.test_arm import moved

LIMITS = JointLimits()
PERIOD_S = 1 / 46.0
STILL = (0.0,) * 6
INSIDE = st.tuples(*(st.floats(lo, hi) for lo, hi in zip(LIMITS.lower_rad, LIMITS.upper_rad, strict=True)))
SPEEDS = st.tuples(*[st.floats(-1.0, 1.0)] * 6)


def test_position_limit():
    near = moved(0.125, joint=1)
    applied = LIMITS.applied(moved(0.2, joint=1), near, STILL, PERIOD_S)
    assert applied.position_rad[1] == 1.70
    assert applied.reason is AppliedReason.POSITION_LIMIT
    at_limit = applied.position_rad
    assert LIMITS.applied(moved(9.0, joint=1), at_limit, STILL, PERIOD_S).reason is AppliedReason.POSITION_LIMIT


def test_acceleration_then_velocity_limit():
    pose, velocity, steps = HOME_RAD, STILL, []
    for _ in range(5):
        applied = LIMITS.applied(moved(1.0), pose, velocity, PERIOD_S)
        assert applied.reason is AppliedReason.VELOCITY_LIMIT
        steps.append((applied.position_rad[0] - pose[0]) / PERIOD_S)
        velocity = tuple((q - p) / PERIOD_S for q, p in zip(applied.position_rad, pose, strict=True))
        pose = applied.position_rad
    assert steps == pytest.approx([19 * PERIOD_S, 38 * PERIOD_S, 1.0, 1.0, 1.0])


def test_the_path_keeps_its_direction():
    asked = tuple(q + step for q, step in zip(HOME_RAD, (0.4, -0.2, 0.1, 0.0, 0.2, -0.4), strict=True))
    applied = LIMITS.applied(asked, HOME_RAD, STILL, PERIOD_S)
    shares = [(q - h) / (a - h) for q, h, a in zip(applied.position_rad, HOME_RAD, asked, strict=True) if a != h]
    assert shares == pytest.approx([shares[0]] * 5)


@given(INSIDE, INSIDE, SPEEDS, st.floats(0.0, PERIOD_S))
def test_applied_lies_between_previous_and_asked_and_keeps_all_limits(asked, previous, velocity, step_s):
    applied = LIMITS.applied(asked, previous, velocity, step_s)
    for q, p, a, v in zip(applied.position_rad, previous, asked, velocity, strict=True):
        assert min(p, a) - 1e-12 <= q <= max(p, a) + 1e-12
        assert abs(q - p) <= 1.0 * step_s + 1e-12
        assert abs(q - p) <= (abs(v) + 19.0 * step_s) * step_s + 1e-12
    assert LIMITS.outside(applied.position_rad, 1e-12) is None
    assert (applied.reason is AppliedReason.AS_ASKED) == (applied.position_rad == asked)


@pytest.mark.parametrize("bad", [nan, inf, -inf])
def test_no_number_is_refused(bad):
    with pytest.raises(RefusedError):
        LIMITS.applied(moved(bad), HOME_RAD, STILL, PERIOD_S)
    assert LIMITS.outside(moved(bad)) == 0


@pytest.mark.parametrize(
    "wrong",
    [
        {"lower_rad": (0.0,) * 5},
        {"lower_rad": (4.0,) * 6},
        {"upper_rad": (nan,) * 6},
        {"velocity_rad_per_s": 0.0},
        {"acceleration_rad_per_s2": inf},
    ],
)
def test_settings_that_cannot_work(wrong):
    with pytest.raises(SettingError):
        JointLimits(**wrong)
