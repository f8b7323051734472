"""Looking for fewer contacts changes nothing: where listed pairs would not do, everything is searched."""

from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from palpate.core.motion import InverseKinematics, Kinematics, arm_named
from palpate.simulation.work_cell import CellConfig
from palpate.simulation.work_cell.config import PegConfig
from tests.support.tool import TOOL
from tests.unit.simulation.work_cell.test_model import GOAL, cell_of, ready_rad

ARM, WANDER_M = "zebra-zero", 5e-3
NOTHING, NEAR, FAR, EVERYTHING = range(4)


def joints_rad(x_mm: float, z_mm: float, turn_rad: float = 0.0, lean_rad: float = 0.0) -> np.ndarray:
    """Joint angles that put the tip there, task frame, turned and leaning from how the tool is held."""
    kinematics = Kinematics(arm_named(ARM), TOOL)
    kinematics.update(ready_rad(ARM))
    rotation = kinematics.tip_rotation @ pin.rpy.rpyToMatrix(0.0, lean_rad, turn_rad)
    place = pin.SE3(rotation, GOAL.act(np.array([x_mm, 0.0, z_mm]) * 1e-3))
    solved: np.ndarray = InverseKinematics(kinematics, 1.0).solve(
        place, free_yaw=False, seed_rad=ready_rad(ARM), field="goal"
    )
    return solved


def motion(config: CellConfig, start_rad: np.ndarray, end_rad: np.ndarray) -> tuple[list[bytes], list[int]]:
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
def test_listed_pairs_give_the_motion_of_a_search_to_the_bit(
    section: str, contact: str, start: tuple[float, ...], end: tuple[float, ...], levels: set[int]
) -> None:
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


@pytest.mark.parametrize("arm", ["zebra-zero", "ur5"])
def test_what_is_kept_before_a_tick_is_all_that_a_step_starts_from_and_changes(arm: str) -> None:
    cell = cell_of(CellConfig(), arm, wander_m=WANDER_M)
    every = int(mujoco.mjtState.mjSTATE_INTEGRATION)
    user = int(mujoco.mjtState.mjSTATE_USER)  # the command, and forces and places that only a caller sets
    before, after = (np.empty(mujoco.mj_stateSize(cell.model, every)) for _ in range(2))
    assert cell.contacts is not None
    kept = sum(array.size for array in cell.contacts._state)
    assert 1 + kept == mujoco.mj_stateSize(cell.model, every & ~user)
    cell.command(tuple(ready_rad(arm) + 0.01))
    cell.advance()
    mujoco.mj_getState(cell.model, cell.data, before, every)
    time_s, state = cell.data.time, [array.tobytes() for array in cell.contacts._state]
    cell.advance()
    cell.contacts._put_back(time_s, *state)
    mujoco.mj_getState(cell.model, cell.data, after, every)
    assert before.tobytes() == after.tobytes()
