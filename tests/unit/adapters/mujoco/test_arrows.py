from math import dist

import numpy as np
import pytest
from PIL import Image, ImageDraw

from palpate.adapters.mujoco import FORCE, View, arrow_pixels, draw_arrow, metres_per_N, reference_N

VIEW = View((0.4, 0.0, 0.02), 0.25, 90.0, 0.0)


@pytest.mark.parametrize(
    ("largest", "reference"),
    [(0.0, 0.5), (2.0, 1.0), (3.9, 1.0), (4.0, 2.0), (7.4, 2.0), (10.0, 5.0), (39.0, 10.0), (1e6, 5e5)],
)
def test_the_reference_is_a_round_number_of_about_half_the_largest_force(largest, reference):
    assert reference_N([0.3, largest]) == reference
    assert reference_N([]) == 0.5


def test_even_the_largest_force_fits_into_the_picture():
    for largest in np.geomspace(1.0, 1000.0, 200):
        length = metres_per_N(reference_N([largest]), VIEW) * largest * VIEW.pixels_per_m(480)
        assert 0.15 * 480 < length <= 0.5 * 480 + 1e-6


def test_an_arrow_is_as_long_as_its_force_and_points_along_it():
    foot = np.array([0.4, 0.0, 0.02])
    scale = metres_per_N(2.0, VIEW)
    begin, up = arrow_pixels(VIEW, (640, 480), foot, np.array([0.0, 0.0, 4.0]), scale)
    _, aside = arrow_pixels(VIEW, (640, 480), foot, np.array([2.0, 0.0, 0.0]), scale)
    assert begin == pytest.approx((320.0, 240.0))
    assert up == pytest.approx((320.0, 240.0 - 0.2 * 480))
    assert aside == pytest.approx((320.0 + 0.1 * 480, 240.0))


def drawn(foot, head):
    picture = Image.new("RGB", (100, 100), (0, 0, 0))
    draw_arrow(ImageDraw.Draw(picture), foot, head, 4.0, FORCE)
    return np.array(picture)


def test_an_arrow_covers_its_way_and_has_a_light_edge():
    pixels = drawn((20, 80), (80, 20))
    rows, columns = np.nonzero((pixels == FORCE).all(axis=2))
    assert dist((columns.min(), rows.max()), (20, 80)) < 5
    assert dist((columns.max(), rows.min()), (80, 20)) < 5
    assert (pixels == 255).all(axis=2).any()
    # The head is broader than the shaft.
    near_foot, near_head = (((columns - x) ** 2 + (rows - y) ** 2 < 64).sum() for x, y in ((30, 70), (74, 26)))
    assert near_head > 1.3 * near_foot


def test_next_to_no_force_is_a_dot():
    rows, columns = np.nonzero((drawn((50, 50), (51, 50)) == FORCE).all(axis=2))
    assert np.ptp(rows) == np.ptp(columns)
    assert (columns.mean(), rows.mean()) == pytest.approx((50, 50), abs=0.5)
