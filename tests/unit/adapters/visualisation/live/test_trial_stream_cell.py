"""The live view shows a peg as what it is, and the film the rim of its hole."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from palpate.adapters.log import read_log
from palpate.adapters.mujoco import DrawnCell
from palpate.adapters.visualisation.live.trial_stream import CellFrames
from palpate.core.job import SIDES
from tests.golden.record import HERE as GOLDEN


@pytest.mark.parametrize("section", SIDES)
def test_a_peg_that_is_not_round_is_drawn_as_a_mesh_that_fits_the_rim_of_its_hole(section: str) -> None:
    log = read_log(GOLDEN / "train-paper.mcap")
    told = log.start.config_toml.replace('"round"', f'"{section}"')
    log = replace(log, start=replace(log.start, config_toml=told))
    drawn = DrawnCell(log)
    (peg,) = CellFrames(log).bodies["peg"]
    assert peg.kind == "mesh"
    end_face = np.array([corner for corner in peg.triangles_m if abs(corner[2]) < 1e-4])
    mujoco.mj_kinematics(drawn.model, drawn.data)
    rim_m = drawn.rim_m(64) - drawn.mouth_m
    assert len(rim_m) % 2 == 0
    widest_m = np.hypot(*end_face[:, :2].T).max()
    assert widest_m == pytest.approx(np.hypot(*rim_m[:, :2].T).max(), rel=0.03)
    # The camera looks from the base's -y.
    assert rim_m[:, 1].max() < 1e-6
