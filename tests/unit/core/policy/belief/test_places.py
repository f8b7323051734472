import numpy as np

from palpate.core.policy.belief.places import Places, off_way_m2

PLACES = Places(1e-3)


def test_what_is_near_a_way_lies_in_its_box_beyond_the_edge_too() -> None:
    rng = np.random.default_rng(3)
    for start, way in rng.uniform(-1.4e-3, 1.4e-3, (200, 2, 2)).round(4):
        box, off_m2 = PLACES.near_way(tuple(start), tuple(way), 2e-4)
        x, y = PLACES.axis_m[:, None] - start[0], PLACES.axis_m[None, :] - start[1]
        everywhere_m2 = off_way_m2(x, y, *way)
        assert np.array_equal(everywhere_m2[box], off_m2)
        everywhere_m2[box] = np.inf
        assert everywhere_m2.min() > 2e-4**2
