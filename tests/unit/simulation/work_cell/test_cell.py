"""The work cell: its MuJoCo model, its gripper's springs, its sensors, and its plate."""

from dataclasses import replace
from functools import cache
from math import cos, hypot, radians, sin

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from palpate.core.job import KEYED, ROUNDED, SIDES
from palpate.core.motion import InverseKinematics, Kinematics, arm_named
from palpate.core.motion.arm import ARMS
from palpate.core.ports.values import CONTROL_RATE_HZ
from palpate.core.trial import GoalConfig, goal_in_base
from palpate.simulation.work_cell import CellConfig, ConditionsConfig, WorkCell
from palpate.simulation.work_cell.config import PLATE_REACH_M, ComplianceConfig, PegConfig, SensorConfig
from tests.support.arms import EVERY_ARM
from tests.support.tool import TOOL

GOAL = goal_in_base(GoalConfig())
READY_M = np.array([0.0, 0.0, -3e-3])
SILENT = SensorConfig(force_noise_N=0.0, torque_noise_Nm=0.0, force_bias_N=0.0, torque_bias_Nm=0.0)


@cache
def ready_rad(arm):
    kinematics = Kinematics(arm_named(arm), TOOL)
    return InverseKinematics(kinematics, 1.0).solve(
        pin.SE3(GOAL.rotation, GOAL.act(READY_M)),
        free_yaw=True,
        seed_rad=np.array(arm_named(arm).posture_rad),
        field="goal",
    )


def cell_of(config, arm="zebra-zero", **more):
    kinematics = Kinematics(arm_named(arm), TOOL)
    return WorkCell(kinematics, config, goal_in_base=GOAL, ready_rad=ready_rad(arm), rate_Hz=CONTROL_RATE_HZ, **more)


def advance(cell, ticks):
    for _ in range(ticks):
        cell.advance()


def deflection(cell, force_N, torque_Nm):
    """What the springs give under a wrench at the tip, base frame: slides in m, hinges in rad, (6,)."""
    springs = cell.joints
    advance(cell, 60)
    before = cell.data.qpos[springs:].copy()
    peg = cell.data.body("peg")
    arm = cell.data.site("tip").xpos - peg.xipos
    peg.xfrc_applied[:] = (*force_N, *np.add(torque_Nm, np.cross(arm, force_N)))
    advance(cell, 100)
    return cell.data.qpos[springs:] - before


# The model.


@pytest.mark.parametrize("arm", ARMS)
def test_arm_stays_at_its_ready_pose(arm):
    cell = cell_of(CellConfig(sensor=SILENT), arm)
    advance(cell, 100)
    assert cell.truth().tip_in_task_m == pytest.approx(tuple(READY_M), abs=2e-6)
    assert cell.joint_angles() == pytest.approx(ready_rad(arm).tolist(), abs=1e-6)


@pytest.mark.parametrize("heading_deg", [0.0, 90.0, 200.0])
@pytest.mark.parametrize("arm", ARMS)
def test_peg_tilts_as_set(arm, heading_deg):
    cell = cell_of(CellConfig(tilt_mrad=20.0, tilt_heading_deg=heading_deg), arm)
    axis = GOAL.rotation.T @ cell.data.body("peg").xmat.reshape(3, 3)[:, 2]
    heading = radians(heading_deg)
    assert axis[:2] == pytest.approx([sin(0.02) * cos(heading), sin(0.02) * sin(heading)], abs=1e-5)
    # It leans about its tip, which stays where kinematics puts it.
    assert cell.truth().tip_in_task_m == pytest.approx(tuple(READY_M), abs=2e-6)


@pytest.mark.parametrize("leaning", [{"tilt_mrad": 2.0}, {"conditions": ConditionsConfig(plate_tilt_mrad=17.5)}])
def test_contacts_are_stiffer_only_where_something_leans(leaning):
    upright, harder = CellConfig(), replace(CellConfig(), tilted_impedance=0.97)
    assert cell_of(upright).model_sha256() == cell_of(harder).model_sha256()
    for config, impedance in ((replace(upright, **leaning), 0.96), (replace(harder, **leaning), 0.97)):
        models = cell_of(config).models
        touching = [model.geom_solimp[model.geom_contype > 0, 0] for model in models]
        listed = [model.pair_solimp[:, 0] for model in models]
        assert set(np.concatenate(touching + listed).tolist()) == {impedance}


# The gripper's springs.


def test_stiffness_is_as_set():
    cell = cell_of(CellConfig())
    up = deflection(cell, (0.0, 0.0, 5.0), (0.0, 0.0, 0.0))
    assert up[2] == pytest.approx(-1e-3, rel=0.02)  # the tool's z points down
    cell.reset(0, 0)
    aside = deflection(cell, (4.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert hypot(aside[0], aside[1]) == pytest.approx(0.1e-3, rel=0.02)
    cell.reset(0, 0)
    tilted = deflection(cell, (0.0, 0.0, 0.0), (0.05, 0.0, 0.0))
    assert hypot(tilted[3], tilted[4]) == pytest.approx(1e-3, rel=0.03)
    cell.reset(0, 0)
    turned = deflection(cell, (0.0, 0.0, 0.0), (0.0, 0.0, 0.05))
    assert turned[5] == pytest.approx(-1e-3, rel=0.03)


@pytest.mark.parametrize("height_mm", [0.0, 40.0, 140.0])
def test_force_across_the_tip_tilts_by_its_lever_about_the_centre_of_compliance(height_mm):
    cell = cell_of(CellConfig(compliance=ComplianceConfig(centre_above_tip_mm=height_mm)))
    bent = deflection(cell, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert hypot(bent[3], bent[4]) == pytest.approx(height_mm * 1e-3 / 50.0, rel=0.05, abs=1e-6)


# Sensors.


@pytest.mark.parametrize("arm", EVERY_ARM)
@pytest.mark.parametrize("more_kg", [0.0, 0.2])
def test_wrench_is_the_weight_of_what_hangs_on_the_sensor(arm, more_kg):
    springs = ComplianceConfig(moving_mass_kg=ComplianceConfig().moving_mass_kg + more_kg)
    cell = cell_of(CellConfig(sensor=SILENT, compliance=springs), arm)
    advance(cell, 100)
    fx, fy, fz, tx, ty, tz = cell.measure_wrench()
    assert (fx, fy, fz) == pytest.approx((0.0, 0.0, (0.35 + more_kg) * 9.81), abs=0.01)
    assert (tx, ty, tz) == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)


def test_noise_and_bias_have_the_size_set():
    sensor = SensorConfig(force_noise_N=0.2, torque_noise_Nm=0.01, force_bias_N=3.0, torque_bias_Nm=0.1)
    cell = cell_of(CellConfig(sensor=sensor))
    still = cell_of(CellConfig(sensor=SILENT)).measure_wrench()
    samples, biases = [], []
    for trial in range(40):
        cell.reset(0, trial)
        samples.append(np.array([cell.measure_wrench() for _ in range(100)]))
        biases.append(samples[-1].mean(axis=0) - still)
    noise = np.mean([sample.std(axis=0) for sample in samples], axis=0)
    assert noise == pytest.approx([0.2] * 3 + [0.01] * 3, rel=0.05)
    assert np.std(biases, axis=0) == pytest.approx([3.0] * 3 + [0.1] * 3, rel=0.4)


def test_encoders_count_in_whole_steps():
    step = np.array(arm_named("zebra-zero").encoder_step_rad)
    cell = cell_of(CellConfig(sensor=replace(SILENT, encoder_counts_share=10.0)))
    counts = np.array(cell.measure_joints()) / (10.0 * step)
    assert counts == pytest.approx(np.round(counts), abs=1e-6)
    assert np.abs(np.array(cell.measure_joints()) - cell.joint_angles()).max() > 0.0
    assert cell_of(CellConfig(sensor=replace(SILENT, encoder_counts_share=0.0))).measure_joints() == tuple(
        ready_rad("zebra-zero")
    )


def test_peak_force_counts_every_physics_step_and_no_weight():
    whole, stepped = cell_of(CellConfig(sensor=SILENT)), cell_of(CellConfig(sensor=SILENT))
    weight_N = np.array(stepped.data.sensordata[:3])
    jerk = tuple(ready_rad("zebra-zero") + 0.001)
    whole.command(jerk)
    stepped.command(jerk)
    advance(whole, 20)
    forces_N = []
    for _ in range(20 * stepped.config.substeps):
        mujoco.mj_step(stepped.model, stepped.data)
        forces_N.append(float(np.linalg.norm(stepped.data.sensordata[:3] - weight_N)))
    assert whole.truth().peak_force_N == pytest.approx(max(forces_N), rel=1e-12)
    # What the control ticks see is less, or the test would tell nothing.
    assert max(forces_N[4::5]) < 0.999 * max(forces_N)


# Trials.


def test_hole_lies_within_its_uncertainty_and_belongs_to_seed_and_trial():
    cell = cell_of(CellConfig(hole_uncertainty_mm=2.0))
    holes = []
    for trial in range(50):
        cell.reset(3, trial)
        holes.append(cell.truth().hole_in_task_m)
        plate = GOAL.actInv(cell.data.body("plate").xpos.copy())
        assert plate == pytest.approx(holes[-1], abs=1e-12)
    assert len(set(holes)) == 50
    assert 1.5e-3 < max(hypot(x, y) for x, y, _ in holes) <= 2e-3
    cell.reset(3, 7)
    assert cell.truth().hole_in_task_m == holes[7]
    cell.reset(4, 7)
    assert cell.truth().hole_in_task_m != holes[7]


def test_reset_starts_anew_but_does_not_turn_time_back():
    cell = cell_of(CellConfig())
    first = [cell.measure_wrench() for _ in range(3)]
    advance(cell, 20)
    cell.command(tuple(ready_rad("zebra-zero") + 0.01))
    advance(cell, 20)
    cell.reset(0, 0)
    assert cell.ticks == 40
    assert cell.joint_angles() == tuple(ready_rad("zebra-zero"))
    assert [cell.measure_wrench() for _ in range(3)] == first
    assert cell.truth().peak_force_N == 0.0


def walls(model):
    """Centre, heading and half sizes of the boxes whose top is the plate's surface, in the plate's plane."""
    found = []
    for geom in np.flatnonzero(model.geom_bodyid == model.body("plate").id):
        position, size = model.geom_pos[geom], model.geom_size[geom]
        if abs(position[2] - size[2]) < 1e-9:
            w, _, _, z = model.geom_quat[geom]
            found.append((position[:2], 2 * np.arctan2(z, w), size[:2]))
    return found


def covered(points, model):
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
def test_surface_has_no_slits_and_the_hole_is_free(shape, boxes, diameter_mm):
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


ARM, DEPTH_M = "zebra-zero", 6e-3


@pytest.mark.parametrize("section", SIDES)
@pytest.mark.parametrize("contacts", ["listed", "searched"])
def test_peg_turned_as_the_hole_is_fits_and_one_that_is_not_does_not(section, contacts):
    kinematics = Kinematics(arm_named(ARM), TOOL)
    conditions = ConditionsConfig(yaw_deg=5.0, plate_tilt_mrad=30.0)
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
