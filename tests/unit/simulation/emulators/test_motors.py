"""The gears against the published relations."""

from math import pi

import numpy as np
import pytest

from palpate.simulation.emulators.motors.plant import HOME_RAD, ArmGears

W = 11_034.53


def test_gears_agree_with_the_published_inverse_and_its_rounded_constants():
    gears = ArmGears()
    for pose in np.random.default_rng(2).uniform(-pi, pi, (2_000, 6)).tolist():
        _, _, e3, e4, e5, e6 = gears.counts(tuple(pose))
        joint4 = e4 / W - e3 / 20_371.83
        joint5 = e6 / (2 * W) + e5 / (4 * W) + e3 / 27_162.44
        joint6 = e6 / W - e5 / (2 * W) + e4 / W - e3 / 40_743.68
        offsets = [angle - home for angle, home in zip(pose, HOME_RAD, strict=True)]
        assert [joint4, joint5, joint6] == pytest.approx(offsets[3:], abs=5e-6)
    assert gears.counts(HOME_RAD) == (0.0,) * 6
    assert gears.counts((HOME_RAD[0] + 2 * pi, *HOME_RAD[1:]))[0] == pytest.approx(192_000, abs=0.5)
