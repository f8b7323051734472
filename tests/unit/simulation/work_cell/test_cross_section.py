from math import atan2, cos, hypot, isclose, pi, remainder, sin, tan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.simulation.work_cell.cross_section import CrossSection

POLYGONS = {"triangle": 3, "square": 4, "hexagon": 6}

sections = st.sampled_from(["round", *POLYGONS])
apothems = st.floats(1e-3, 50e-3)
counts = st.integers(12, 200)


def section(name: str, apothem_m: float) -> CrossSection:
    return CrossSection(POLYGONS.get(name, 0), apothem_m)


@given(st.floats(0.05, 0.9), st.integers(12, 80), st.floats(1e-6, 1e-3), st.booleans())
def test_round_parts_have_their_clearance_at_every_wall(share: float, count: int, by_m: float, keyed: bool) -> None:
    """A keyed one, or a square with round corners."""
    peg = CrossSection(0, 10e-3, flat_m=share * 10e-3) if keyed else CrossSection(4, 10e-3, corner_m=share * 10e-3)
    outline, hole = peg.outline(count), peg.grown(by_m)
    walls = hole.walls(count, 1e-3)
    assert {len(walls) % 4 for _ in "1" if not keyed} <= {0}
    for wall in walls:
        c, s = cos(wall.heading_rad), sin(wall.heading_rad)
        gap_m = wall.distance_m - max(c * x + s * y for x, y in outline)
        # Grown, the sharp corner of a flat moves out farther than that.
        assert by_m - 1e-12 <= gap_m <= (4.0 * by_m if keyed else by_m + 1e-12)
    assert isclose(walls[0].distance_m, (share * 10e-3 if keyed else 10e-3) + by_m)


@given(sections, apothems, counts, st.floats(-pi, pi), st.floats(0.0, 1.0))
def test_walls_leave_no_gap_up_to_their_reach(
    name: str, apothem_m: float, boxes: int, heading: float, share: float
) -> None:
    reach_m = 9e-3
    walls = section(name, apothem_m).walls(boxes, reach_m)
    nearest = min(walls, key=lambda wall: abs(remainder(heading - wall.heading_rad, 2 * pi)))
    along_m = (apothem_m + share * reach_m) * tan(remainder(heading - nearest.heading_rad, 2 * pi))
    assert abs(along_m) <= nearest.half_width_m


@given(sections, apothems, counts)
def test_walls_touch_the_inscribed_circle(name: str, apothem_m: float, boxes: int) -> None:
    walls = section(name, apothem_m).walls(boxes, 1e-3)
    assert len(walls) == POLYGONS.get(name, boxes)
    assert {wall.distance_m for wall in walls} == {apothem_m}
    assert len({wall.heading_rad for wall in walls}) == len(walls)


@pytest.mark.parametrize("name", POLYGONS)
@given(apothem_m=apothems, count=counts, clearance_m=st.floats(1e-6, 5e-3))
def test_a_polygonal_peg_has_its_clearance_at_every_wall(
    name: str, apothem_m: float, count: int, clearance_m: float
) -> None:
    radius_m = 1e-4
    rim = section(name, apothem_m).rim(count, radius_m)
    for wall in section(name, apothem_m + clearance_m).walls(48, 1e-3):
        c, s = cos(wall.heading_rad), sin(wall.heading_rad)
        gap_m = wall.distance_m - max(c * x + s * y for x, y in rim) - radius_m
        assert isclose(gap_m, clearance_m, abs_tol=1e-12)


@given(apothem_m=apothems, count=counts)
def test_a_round_rim_is_a_circle_of_evenly_spaced_points(apothem_m: float, count: int) -> None:
    rim = section("round", apothem_m).rim(count, 1e-4)
    assert len(rim) == count
    for k, (x, y) in enumerate(rim):
        assert isclose(hypot(x, y), apothem_m - 1e-4, rel_tol=1e-12)
        assert abs(remainder(atan2(y, x) - 2 * pi * k / count, 2 * pi)) < 1e-9


@pytest.mark.parametrize("name", POLYGONS)
@given(count=counts)
def test_a_polygonal_rim_has_its_corners_and_no_wide_gaps(name: str, count: int) -> None:
    sides = POLYGONS[name]
    rim = section(name, 10e-3).rim(count, 0.0)
    side_m = 20e-3 * tan(pi / sides)
    corners = [point for point in rim if isclose(hypot(*point), 10e-3 / cos(pi / sides), rel_tol=1e-9)]
    steps = [hypot(bx - ax, by - ay) for (ax, ay), (bx, by) in zip(rim, rim[1:] + rim[:1], strict=True)]
    assert len(rim) >= count
    assert len(corners) == sides
    assert max(steps) <= side_m * sides / count + 1e-12
    assert isclose(sum(steps), side_m * sides)
