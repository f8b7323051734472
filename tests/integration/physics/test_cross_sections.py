"""Pegs of every shape fit their holes: the gap is the clearance on every side, and they go in."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments import Run
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.job import KEYED, SIDES
from palpate.core.motion.arm import ARMS
from palpate.core.trial.report import Outcome
from palpate.simulation.work_cell.config import CellConfig, PegConfig
from tests.support.physics_bench import ready_pose

# A keyed peg fits in one way only: it shows how each arm holds it.
CASES = [
    *((section, "zebra-zero") for section in ("round", *SIDES)),
    (KEYED, "panda"),
    *(pytest.param(KEYED, arm, marks=pytest.mark.nightly) for arm in ARMS if arm not in ("zebra-zero", "panda")),
]


def config_of(arm, section):
    return RunConfig(arm=arm, cell=CellConfig(peg=PegConfig(cross_section=section)))


def gaps_m(rig):
    """Distance from each wall of the hole to the nearest sphere, or corner, of the centred peg."""
    model, data = rig.cell.model, rig.cell.data
    mujoco.mj_kinematics(model, data)
    spheres = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE)
    centres, radius = data.geom_xpos[spheres], model.geom_size[spheres[0], 0] if len(spheres) else 0.0
    for mesh in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH):
        centres = data.geom_xpos[mesh] + model.mesh_vert @ data.geom_xmat[mesh].reshape(3, 3).T
    hole = data.body("plate").xpos
    gaps = []
    for box in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_BOX):
        normal = data.geom_xmat[box].reshape(3, 3)[:, 0]
        face = normal @ (data.geom_xpos[box] - hole) - model.geom_size[box, 0]
        gaps.append(float((face - radius - (centres - hole) @ normal).min()))
    # The ring at the hole comes first; then the outer ring and the floor.
    return gaps[: rig.cell.config.peg.walls]


@pytest.mark.parametrize(("section", "arm"), CASES)
def test_gap_is_the_clearance_on_every_side(section, arm):
    config = config_of(arm, section)
    with SimulatedRig(config, ready_pose(arm)) as rig:
        gaps = gaps_m(rig)
    # The ready pose is solved to a micrometre and a microradian; at a flat's sharp corners walls stand back a little.
    assert gaps == pytest.approx([75e-6] * len(gaps), abs=5e-6 if section == KEYED else 2e-6)


@pytest.mark.parametrize(("section", "arm"), CASES)
def test_centred_peg_goes_in_to_10_mm(section, arm):
    config = config_of(arm, section)
    config = replace(config, task=replace(config.task, start_uncertainty_mm=0.0))
    (row,) = Run(config).evaluate(1, "oracle").rows
    assert row.outcome == Outcome.INSERTED.value
    assert row.depth_mm == pytest.approx(10.0, abs=0.05)
    assert row.peak_force_N < config.task.max_force_N
