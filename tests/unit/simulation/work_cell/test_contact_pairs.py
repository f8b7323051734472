"""Every pair that can touch within the leeway is listed."""

from math import cos, sin

from hypothesis import given
from hypothesis import strategies as st

from palpate.simulation.work_cell.config import PLATE_REACH_M, CellConfig, PegConfig
from palpate.simulation.work_cell.contact_pairs import Leeway, listed_pairs
from palpate.simulation.work_cell.contact_shapes import UPPER_RING_M, peg_rings, plate_boxes

shares = st.floats(0.0, 1.0)
angles = st.floats(-3.2, 3.2)


@given(
    st.sampled_from(["round", "triangle", "square", "hexagon"]),
    st.sampled_from([(10.0, 0.02), (29.0, 0.075), (29.0, 1.0), (60.0, 0.3)]),
    st.floats(0.0, 20.0),
    st.tuples(shares, angles, shares, angles, st.floats(-1.0, 1.0)),
)
def test_a_sphere_above_a_box_has_a_pair_with_it(
    section: str, size_mm: tuple[float, float], tilt_mrad: float, pose: tuple[float, float, float, float, float]
) -> None:
    peg = PegConfig(cross_section=section, contact="spheres", diameter_mm=size_mm[0], clearance_mm=size_mm[1])
    config = CellConfig(peg=peg, tilt_mrad=tilt_mrad)
    boxes, leeway = plate_boxes(peg, PLATE_REACH_M), Leeway.of(config, 6e-3)
    listed = set(listed_pairs(config, boxes, leeway))
    aside, heading, lean, leans_to, turn = pose
    lower, upper = peg_rings(peg)
    for first, ring, height, most_m in (
        (0, lower, 0.0, leeway.aside_m),
        (len(lower), upper, UPPER_RING_M, leeway.play_m - UPPER_RING_M * leeway.lean),
    ):
        dx, dy = aside * most_m * cos(heading), aside * most_m * sin(heading)
        dx += height * lean * leeway.lean * cos(leans_to)
        dy += height * lean * leeway.lean * sin(leans_to)
        angle = turn * leeway.turn
        for sphere, (px, py) in enumerate(ring, first):
            x, y = cos(angle) * px - sin(angle) * py + dx, sin(angle) * px + cos(angle) * py + dy
            for number, box in enumerate(boxes[:-1]):
                c, s = cos(box.heading_rad), sin(box.heading_rad)
                along, across = c * x + s * y - box.distance_m, c * y - s * x
                if abs(along) <= box.half_m[0] and abs(across) <= box.half_m[1]:
                    assert (sphere, number) in listed
    assert {(sphere, len(boxes) - 1) for sphere in range(len(lower))} <= listed
