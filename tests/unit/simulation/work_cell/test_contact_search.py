"""Looking for fewer contacts changes nothing: where listed pairs would not do, everything is searched."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from palpate.core.motion import InverseKinematics, Kinematics, ToolGeometry, arm_named
from palpate.simulation.work_cell import CellConfig, WorkCell
from palpate.simulation.work_cell.config import PegConfig
from palpate.simulation.work_cell.contact_search import Search
from tests.unit.simulation.work_cell.test_model import GOAL, cell_of, ready_rad

ARM = "zebra-zero"


def joints_rad(x_mm: float, z_mm: float, turn_rad: float = 0.0, lean_rad: float = 0.0) -> np.ndarray:
    """Joint angles that put the tip there, task frame, turned and leaning from how the tool is held."""
    kinematics = Kinematics(arm_named(ARM), ToolGeometry())
    kinematics.update(ready_rad(ARM))
    rotation = kinematics.tip_rotation @ pin.rpy.rpyToMatrix(0.0, lean_rad, turn_rad)
    place = pin.SE3(rotation, GOAL.act(np.array([x_mm, 0.0, z_mm]) * 1e-3))
    solved: np.ndarray = InverseKinematics(kinematics, 1.0).solve(
        place, free_yaw=False, seed_rad=ready_rad(ARM), field="goal"
    )
    return solved


def motion(cell: WorkCell, start_rad: np.ndarray, end_rad: np.ndarray) -> tuple[np.ndarray, set[Search]]:
    """The springs and joints after each tick on a way that is commanded at one stroke, and what was looked for."""
    cell.place(start_rad)
    cell.command(tuple(end_rad))
    states, searches = [], set()
    for _ in range(30):
        cell.advance()
        states.append(np.concatenate((cell.data.qpos, cell.data.sensordata[:6])))
        if cell.contacts is not None:
            searches.add(cell.contacts.search)
    assert len(cell.data.contact)
    return np.array(states), searches


@pytest.mark.parametrize(
    ("start", "end", "searches"),
    [
        ((0.6, -0.5), (0.6, 1.0), {Search.LISTED}),
        ((0.6, -4.0), (0.6, 3.0), {Search.NOTHING, Search.LISTED}),  # within one tick into the plate, if it could
        ((0.0, 2.0), (0.1, 12.0), {Search.LISTED}),
        ((0.5, -0.2), (9.0, 1.0), {Search.EVERYTHING}),
        ((1.0, -0.2, 0.1), (1.0, 1.0, 0.1), {Search.EVERYTHING}),
        ((1.0, -2.0, 0.0, 0.1), (1.0, 0.5, 0.0, 0.1), {Search.EVERYTHING}),
        ((-8.0, -5.0), (30.0, 12.0), {Search.NOTHING, Search.EVERYTHING}),  # off the plate's edge
    ],
)
@pytest.mark.parametrize("section", ["round", "square"])
def test_listed_pairs_give_the_motion_of_a_search(
    section: str, start: tuple[float, ...], end: tuple[float, ...], searches: set[Search]
) -> None:
    listed = CellConfig(peg=PegConfig(cross_section=section))
    way = joints_rad(*start), joints_rad(*end)
    states, looked_for = motion(cell_of(listed), *way)
    searched, _ = motion(cell_of(replace(listed, contacts="searched")), *way)
    # Where everything is searched, contacts may come in another order, and sums of their forces in another last bit.
    np.testing.assert_allclose(states, searched, rtol=0.0, atol=1e-9 if Search.EVERYTHING in searches else 0.0)
    assert looked_for == searches
