"""Where points come to lie in a picture."""

import numpy as np
import pytest

from palpate.adapters.mujoco.views import View, close_up, whole_arm

MOUTH = np.array([0.4, 0.01, 0.02])


def test_the_target_is_in_the_middle_and_lengths_have_the_scale():
    view = View((0.4, 0.0, 0.02), 0.5, 90.0, 0.0)
    assert view.pixel_of(np.array([0.4, 0.0, 0.02]), 640, 480) == pytest.approx((320.0, 240.0))
    scale = view.pixels_per_m(480)
    # From behind -y one sees x to the right and z up.
    assert view.pixel_of(np.array([0.41, 0.0, 0.05]), 640, 480) == pytest.approx(
        (320 + 0.01 * scale, 240 - 0.03 * scale)
    )


def test_what_is_farther_away_is_smaller():
    view = View((0.0, 0.0, 0.0), 0.5, 90.0, 0.0)
    near, far = (view.pixel_of(np.array([0.01, y, 0.0]), 640, 480)[0] - 320 for y in (-0.25, 0.5))
    assert near == pytest.approx(4 * far)


def test_axes_are_right_handed_whatever_the_heading():
    for azimuth, elevation in ((0.0, 0.0), (125.0, -18.0), (-70.0, 40.0)):
        right, up, forward = View((0.0, 0.0, 0.0), 1.0, azimuth, elevation).axes
        assert np.cross(right, up) == pytest.approx(-forward)
        assert right[2] == 0.0
        assert up[2] > 0.0


@pytest.mark.parametrize("diameter_m", [0.005, 0.029, 0.1])
def test_the_close_up_holds_peg_and_hole_whatever_their_size(diameter_m):
    view = close_up(MOUTH, diameter_m)
    assert view.cut
    for sign in (-1.0, 1.0):
        x, y = view.pixel_of(MOUTH + np.array([sign * diameter_m / 2, 0.0, 0.0]), 640, 480)
        assert abs(x - 320) == pytest.approx(77.4, abs=1.0)
        assert 240 < y < 320


def test_the_whole_arm_is_within_its_picture():
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.1, 0.7], [0.4, -0.2, 0.5], [0.4, 0.0, 0.02]])
    view = whole_arm(points)
    pixels = np.array([view.pixel_of(point, 300, 300) for point in points])
    assert pixels.min() > 10
    assert pixels.max() < 290
    assert np.ptp(pixels, axis=0).max() > 150
