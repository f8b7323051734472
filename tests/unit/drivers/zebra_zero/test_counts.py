"""The transmission against its equations, written out once more, and its own inverse."""

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.errors import RefusedError, SettingError
from palpate.drivers.zebra_zero.counts import ALTERNATIVE_WRIST_FACTOR, HOME_RAD, Transmission

C, W = 30557.75, 11034.53
PLAIN = Transmission()
VARIANTS = [PLAIN, Transmission(joint_1_sign=-1), Transmission(wrist_factor=ALTERNATIVE_WRIST_FACTOR)]
COUNTS = st.tuples(*[st.integers(-200_000, 200_000)] * 6)


def test_home_is_zero_counts():
    assert PLAIN.to_counts(HOME_RAD) == (0,) * 6
    assert PLAIN.to_rad((0,) * 6) == HOME_RAD
    assert pytest.approx((0, pi / 2, -pi / 2, 0, -pi / 2, 0)) == HOME_RAD


def test_counts_per_turn():
    assert 2 * pi * C == pytest.approx(192_000, abs=0.1)
    assert 2 * pi * W == pytest.approx(69_332, abs=0.1)
    turned = PLAIN.to_counts((1.0, *HOME_RAD[1:]))
    assert turned == (30558, 0, 0, 0, 0, 0)
    assert VARIANTS[1].to_counts((1.0, *HOME_RAD[1:])) == (-30558, 0, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("joint", "coefficients"),
    [
        (2, (0, 0, C, 1.5 * W, -1.5 * W, -1.5 * W)),
        (3, (0, 0, 0, W, W, -W / 2)),
        (4, (0, 0, 0, 0, 2 * W, W)),
        (5, (0, 0, 0, 0, -W, W / 2)),
    ],
)
def test_wrist_coupling(joint, coefficients):
    pose = [q + (j == joint) for j, q in enumerate(HOME_RAD)]
    assert PLAIN.to_counts(pose) == tuple(round(c) for c in coefficients)
    scaled = VARIANTS[2].to_counts(pose)
    factors = (1, 1, 1, *[24.0 / 17.33] * 3)
    assert scaled == tuple(round(c * k) for c, k in zip(coefficients, factors, strict=True))


def test_inverse_agrees_with_the_published_rounded_constants():
    e = (1000, -2000, 30_000, 4000, -5000, 6000)
    d3 = e[2] / C
    published = (
        e[3] / W - e[2] / 20371.83,
        e[5] / (2 * W) + e[4] / (4 * W) + e[2] / 27162.44,
        e[5] / W - e[4] / (2 * W) + e[3] / W - e[2] / 40743.68,
    )
    found = [q - home for q, home in zip(PLAIN.to_rad(e), HOME_RAD, strict=True)]
    assert found[2] == pytest.approx(d3)
    assert found[3:] == pytest.approx(published, abs=1e-6)


@given(COUNTS, st.sampled_from(VARIANTS))
def test_counts_come_back_exactly(counts, transmission):
    assert transmission.to_counts(transmission.to_rad(counts)) == counts


def test_motor_rates_are_never_exceeded():
    rates = PLAIN.motor_rates((1.0,) * 6)
    assert rates[:4] == pytest.approx((C, C, C, 2.5 * W))
    assert rates[4:] == pytest.approx((5.5 * W, 3.5 * W))


@pytest.mark.parametrize("bad", [(0.0,) * 5, (0.0,) * 7, (float("nan"), *[0.0] * 5), (*[0.0] * 5, float("inf"))])
def test_what_is_no_pose_is_refused(bad):
    with pytest.raises(RefusedError):
        PLAIN.to_counts(bad)


@pytest.mark.parametrize("wrong", [{"joint_1_sign": 0}, {"wrist_factor": 0.0}, {"wrist_factor": float("nan")}])
def test_settings_that_cannot_work(wrong):
    with pytest.raises(SettingError):
        Transmission(**wrong)
