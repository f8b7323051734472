"""The Zebra's transmission against its equations and its own inverse; settings."""

from math import inf, nan, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.errors import RefusedError, SettingError
from palpate.drivers.nmc import BusSettings
from palpate.drivers.zebra_zero import Transmission, ZebraZeroSettings
from palpate.drivers.zebra_zero.codec import ALTERNATIVE_WRIST_FACTOR, HOME_RAD

C, W = 30557.75, 11034.53
PLAIN = Transmission()
VARIANTS = [PLAIN, Transmission(joint_1_sign=-1), Transmission(wrist_factor=ALTERNATIVE_WRIST_FACTOR)]


def test_home_is_zero_counts_and_a_turn_has_as_many_as_published():
    assert PLAIN.to_counts(HOME_RAD) == (0,) * 6
    assert PLAIN.to_rad((0,) * 6) == HOME_RAD
    assert 2 * pi * C == pytest.approx(192_000, abs=0.1)
    assert 2 * pi * W == pytest.approx(69_332, abs=0.1)
    assert PLAIN.to_counts((1.0, *HOME_RAD[1:])) == (30558, 0, 0, 0, 0, 0)
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
def test_wrist_is_coupled(joint, coefficients):
    pose = [q + (j == joint) for j, q in enumerate(HOME_RAD)]
    assert PLAIN.to_counts(pose) == tuple(round(c) for c in coefficients)
    factors = (1, 1, 1, *[24.0 / 17.33] * 3)
    expected = tuple(round(c * k) for c, k in zip(coefficients, factors, strict=True))
    assert VARIANTS[2].to_counts(pose) == expected


def test_inverse_agrees_with_the_published_rounded_constants():
    e = (1000, -2000, 30_000, 4000, -5000, 6000)
    published = (
        e[3] / W - e[2] / 20371.83,
        e[5] / (2 * W) + e[4] / (4 * W) + e[2] / 27162.44,
        e[5] / W - e[4] / (2 * W) + e[3] / W - e[2] / 40743.68,
    )
    found = [q - home for q, home in zip(PLAIN.to_rad(e), HOME_RAD, strict=True)]
    assert found[2] == pytest.approx(e[2] / C)
    assert found[3:] == pytest.approx(published, abs=1e-6)


@given(st.tuples(*[st.integers(-200_000, 200_000)] * 6), st.sampled_from(VARIANTS))
def test_counts_come_back_exactly(counts, transmission):
    assert transmission.to_counts(transmission.to_rad(counts)) == counts


@pytest.mark.parametrize("bad", [(0.0,) * 5, (0.0,) * 7, (nan, *[0.0] * 5), (*[0.0] * 5, inf)])
def test_pose_of_other_than_six_finite_angles_is_refused(bad):
    with pytest.raises(RefusedError):
        PLAIN.to_counts(bad)


def test_rate_that_the_bus_cannot_carry_is_refused():
    with pytest.raises(
        SettingError, match=r"140 Hz does not fit the bus, which carries 62\.79 Hz; choose a larger divider"
    ):
        ZebraZeroSettings(control_rate_Hz=140, divider=1)
    ZebraZeroSettings(control_rate_Hz=140, divider=1, bus=BusSettings(baud=230_400, adapter_latency_s=0.0))
