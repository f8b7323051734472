"""The plate is closed everywhere round the hole, and nothing of it is inside the hole."""

import mujoco
import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.job import KEYED, ROUNDED, SIDES
from palpate.simulation.work_cell.config import PLATE_REACH_M, CellConfig, PegConfig
from tests.unit.simulation.work_cell.test_model import cell_of


def walls(model: mujoco.MjModel) -> list[tuple[np.ndarray, float, np.ndarray]]:
    """Centre, heading and half sizes of the boxes whose top is the plate's surface, in the plate's plane."""
    found = []
    for geom in np.flatnonzero(model.geom_bodyid == model.body("plate").id):
        position, size = model.geom_pos[geom], model.geom_size[geom]
        if abs(position[2] - size[2]) < 1e-9:
            w, _, _, z = model.geom_quat[geom]
            found.append((position[:2], 2 * np.arctan2(z, w), size[:2]))
    return found


def covered(points: np.ndarray, model: mujoco.MjModel) -> np.ndarray:
    """Whether each point of the plane lies on some wall."""
    hit = np.zeros(len(points), dtype=bool)
    for centre, heading, half in walls(model):
        c, s = np.cos(heading), np.sin(heading)
        local = (points - centre) @ np.array([[c, -s], [s, c]])
        hit |= (np.abs(local) <= half).all(axis=1)
    return hit


@pytest.mark.parametrize(
    ("shape", "boxes", "diameter_mm"),
    [("round", 16, 29.0), ("round", 48, 29.0), ("round", 64, 50.0), ("round", 48, 100.0)]
    + [(shape, 48, 29.0) for shape in SIDES]
    + [(shape, 33, 60.0) for shape in (ROUNDED, KEYED)],
)
def test_the_surface_has_no_slits_and_the_hole_is_free(shape: str, boxes: int, diameter_mm: float) -> None:
    peg = PegConfig(cross_section=shape, wall_boxes=boxes, diameter_mm=diameter_mm)
    model = cell_of(CellConfig(peg=peg)).model
    angles = np.linspace(0.0, 2 * np.pi, 721)
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    # Distance of the hole's edge from its axis, heading by heading: its outline is a polygon in any case.
    sides = peg.section(peg.clearance_mm).walls(peg.facets[0], 0.0)
    towards = directions @ np.array([(np.cos(side.heading_rad), np.sin(side.heading_rad)) for side in sides]).T
    ways = np.where(towards > 1e-3, np.array([side.distance_m for side in sides]) / np.maximum(towards, 1e-3), np.inf)
    edge = ways.min(axis=1)
    for beyond_m in np.arange(1e-5, PLATE_REACH_M, 1e-4):
        assert covered(directions * (edge + beyond_m)[:, None], model).all(), beyond_m
    assert not covered(directions * (edge - 1e-6)[:, None], model).any()


@pytest.mark.parametrize("numbers", [{"outer_boxes": 5}, {"outer_boxes": 1}, {"upper_spheres": 11}])
def test_numbers_that_leave_no_hole_or_no_ring_are_refused(numbers: dict[str, int]) -> None:
    with pytest.raises(ConfigurationError, match=r"a whole number from (6|12) to 512, or 0"):
        PegConfig(**numbers)
