"""A hole that is turned and leans: a peg turned like it fits, one that is not does not; depth is along its axis."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from palpate.core.job import SIDES
from palpate.core.motion import InverseKinematics, Kinematics, arm_named
from palpate.simulation.work_cell import CellConfig, ConditionsConfig
from palpate.simulation.work_cell.config import PegConfig
from tests.support.tool import TOOL
from tests.unit.simulation.work_cell.test_model import GOAL, cell_of, ready_rad

ARM, DEPTH_M = "zebra-zero", 6e-3


@pytest.mark.parametrize("section", SIDES)
@pytest.mark.parametrize("contacts", ["listed", "searched"])
def test_a_peg_turned_as_the_hole_is_fits_and_one_that_is_not_does_not(section: str, contacts: str) -> None:
    kinematics = Kinematics(arm_named(ARM), TOOL)
    conditions = ConditionsConfig(yaw_deg=5.0, plate_lean_mrad=30.0)
    config = CellConfig(peg=PegConfig(cross_section=section), contacts=contacts, hole_uncertainty_mm=3.0)
    cell = cell_of(replace(config, conditions=conditions))
    kinematics.update(ready_rad(ARM))
    held = GOAL.rotation.T @ kinematics.tip_rotation
    for trial in range(2):
        cell.reset(3, trial)
        truth = cell.truth()
        turn = pin.exp3(np.array(truth.hole_turn_rad))
        inside = np.array(truth.hole_in_task_m) + DEPTH_M * turn[:, 2]
        for rotation, fits in ((turn, True), (np.eye(3), False)):
            tip = pin.SE3(GOAL.rotation @ rotation @ held, GOAL.act(inside))
            inverse = InverseKinematics(kinematics, 1.0)
            cell.place(inverse.solve(tip, free_yaw=False, seed_rad=ready_rad(ARM), field="goal"))
            truth = cell.truth()
            deepest_m = -min((contact.dist for contact in cell.data.contact), default=0.0)
            assert (deepest_m < 1e-6) is fits
            assert truth.depth_m == pytest.approx(DEPTH_M, abs=2e-6)
            assert truth.aside_m < 2e-6
