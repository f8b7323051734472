"""Outlines of pegs and holes, and the contacts between them, listed or searched."""

from dataclasses import replace
from math import cos, isclose, sin

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.motion import InverseKinematics, Kinematics, arm_named
from palpate.simulation.work_cell import CellConfig
from palpate.simulation.work_cell.config import PLATE_REACH_M, PegConfig
from palpate.simulation.work_cell.contact_pairs import Leeway, listed_pairs
from palpate.simulation.work_cell.contact_shapes import UPPER_RING_M, peg_rings, plate_boxes
from palpate.simulation.work_cell.cross_section import CrossSection
from tests.support.tool import TOOL
from tests.unit.simulation.work_cell.test_cell import GOAL, cell_of, ready_rad

POLYGONS = {"triangle": 3, "square": 4, "hexagon": 6}

sections = st.sampled_from(["round", *POLYGONS])
apothems = st.floats(1e-3, 50e-3)
counts = st.integers(12, 200)


def section(name, apothem_m):
    return CrossSection(POLYGONS.get(name, 0), apothem_m)


@given(st.floats(0.05, 0.9), st.integers(12, 80), st.floats(1e-6, 1e-3), st.booleans())
def test_round_parts_have_their_clearance_at_every_wall(share, count, by_m, keyed):
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


@pytest.mark.parametrize("name", POLYGONS)
@given(apothem_m=apothems, count=counts, clearance_m=st.floats(1e-6, 5e-3))
def test_polygonal_peg_has_its_clearance_at_every_wall(name, apothem_m, count, clearance_m):
    radius_m = 1e-4
    rim = section(name, apothem_m).rim(count, radius_m)
    for wall in section(name, apothem_m + clearance_m).walls(48, 1e-3):
        c, s = cos(wall.heading_rad), sin(wall.heading_rad)
        gap_m = wall.distance_m - max(c * x + s * y for x, y in rim) - radius_m
        assert isclose(gap_m, clearance_m, abs_tol=1e-12)


shares = st.floats(0.0, 1.0)
angles = st.floats(-3.2, 3.2)


@given(
    st.sampled_from(["round", "triangle", "square", "hexagon"]),
    st.sampled_from([(10.0, 0.02), (29.0, 0.075), (29.0, 1.0), (60.0, 0.3)]),
    st.floats(0.0, 20.0),
    st.tuples(shares, angles, shares, angles, st.floats(-1.0, 1.0)),
)
def test_sphere_above_a_box_has_a_pair_with_it(section, size_mm, tilt_mrad, pose):
    peg = PegConfig(cross_section=section, contact="spheres", diameter_mm=size_mm[0], clearance_mm=size_mm[1])
    config = CellConfig(peg=peg, tilt_mrad=tilt_mrad)
    boxes, leeway = plate_boxes(peg, PLATE_REACH_M), Leeway.of(config, 6e-3)
    listed = set(listed_pairs(config, boxes, leeway))
    aside, heading, tilt, leans_to, turn = pose
    lower, upper = peg_rings(peg)
    rings = [
        (0, lower, 0.0, leeway.aside_m),
        (len(lower), upper, UPPER_RING_M, leeway.play_m - UPPER_RING_M * leeway.tilt),
    ]
    # A shaft takes the place of the upper ring.
    for first, ring, height, most_m in rings[: 1 if config.has_shaft else 2]:
        dx, dy = aside * most_m * cos(heading), aside * most_m * sin(heading)
        dx += height * tilt * leeway.tilt * cos(leans_to)
        dy += height * tilt * leeway.tilt * sin(leans_to)
        angle = turn * leeway.turn
        for sphere, (px, py) in enumerate(ring, first):
            x, y = cos(angle) * px - sin(angle) * py + dx, sin(angle) * px + cos(angle) * py + dy
            for number, box in enumerate(boxes[:-1]):
                c, s = cos(box.heading_rad), sin(box.heading_rad)
                along, across = c * x + s * y - box.distance_m, c * y - s * x
                if abs(along) <= box.half_m[0] and abs(across) <= box.half_m[1]:
                    assert (sphere, number) in listed
    assert {(sphere, len(boxes) - 1) for sphere in range(len(lower))} <= listed


ARM, WANDER_M = "zebra-zero", 5e-3
NOTHING, NEAR, FAR, EVERYTHING = range(4)


def joints_rad(x_mm, z_mm, turn_rad=0.0, tilt_rad=0.0):
    """Joint angles that put the tip there, task frame, turned and leaning from how the tool is held."""
    kinematics = Kinematics(arm_named(ARM), TOOL)
    kinematics.update(ready_rad(ARM))
    rotation = kinematics.tip_rotation @ pin.rpy.rpyToMatrix(0.0, tilt_rad, turn_rad)
    place = pin.SE3(rotation, GOAL.act(np.array([x_mm, 0.0, z_mm]) * 1e-3))
    return InverseKinematics(kinematics, 1.0).solve(place, free_yaw=False, seed_rad=ready_rad(ARM), field="goal")


def motion(config, start_rad, end_rad):
    """State and wrench after each tick of a way commanded at one stroke, and the levels of search on it."""
    cell = cell_of(config, wander_m=WANDER_M)
    cell.place(start_rad)
    cell.command(tuple(end_rad))
    states, levels = [], []
    for _ in range(30):
        cell.advance()
        states.append(cell.data.qpos.tobytes() + cell.data.sensordata[:6].tobytes())
        levels += [cell.contacts.level] if cell.contacts is not None else []
    assert len(cell.data.contact)
    return states, levels


@pytest.mark.parametrize(
    ("start", "end", "levels"),
    [
        ((0.6, -0.5), (0.6, 1.0), {NEAR}),
        ((0.6, -4.0), (0.6, 3.0), {NOTHING, NEAR}),  # within one tick into the plate, were it not done over
        ((0.0, 2.0), (0.1, 12.0), {NEAR}),
        ((0.5, -0.2), (4.5, 1.0), {NEAR, FAR}),
        ((0.5, -0.2), (9.0, 1.0), {NEAR, FAR, EVERYTHING}),
        ((1.0, -0.2, 0.1), (1.0, 1.0, 0.1), {EVERYTHING}),  # turned
        ((1.0, -2.0, 0.0, 0.1), (1.0, 0.5, 0.0, 0.1), {EVERYTHING}),  # leaning
        ((-8.0, -5.0), (30.0, 12.0), {NOTHING, EVERYTHING}),  # off the plate's edge
    ],
)
@pytest.mark.parametrize(("section", "contact"), [("round", "hull"), ("square", "spheres"), ("square", "hull")])
def test_listed_pairs_give_the_motion_of_a_search_to_the_bit(section, contact, start, end, levels):
    listed = CellConfig(peg=PegConfig(cross_section=section, contact=contact))
    way = joints_rad(*start), joints_rad(*end)
    states, used = motion(listed, *way)
    assert states == motion(replace(listed, contacts="searched"), *way)[0]
    tight = replace(listed, peg=replace(listed.peg, clearance_mm=0.008))
    assert motion(tight, *way)[0] == motion(replace(tight, contacts="searched"), *way)[0]
    if listed.peg.is_hull:
        # A solid has few pairs: either none is looked for or all are.
        levels = {min(level, 1) for level in levels}
    assert set(used) <= levels
    assert used[-1] == max(levels)
