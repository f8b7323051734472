"""Build the cell's MuJoCo model: arm, wrist sensor, compliant gripper, peg, and plate with hole.

The arm is converted from the core's Pinocchio model, body by body, so both have the same geometry. A round peg
makes contact through small spheres on its rim with boxes around the hole, because that pair has an exact collider: a
plain cylinder on a flat plate gives torque directions that are wrong by tens of degrees (``docs/results.md``). A peg
with sides is one convex body.
"""

from itertools import product
from math import cos, hypot, sin, sqrt
from typing import Any, Final

import mujoco
import numpy as np
import pinocchio as pin

from palpate.core.errors import AssetError
from palpate.core.motion import Kinematics
from palpate.simulation.work_cell.arm_dynamics import body_inertias, servos
from palpate.simulation.work_cell.config import PLATE_REACH_M, CellConfig
from palpate.simulation.work_cell.contact_impedance import CONTACT_TIME_S, contact_impedance
from palpate.simulation.work_cell.contact_pairs import Leeway, listed_pairs
from palpate.simulation.work_cell.contact_shapes import (
    UPPER_RING_M,
    Box,
    mouth_ring,
    peg_corners,
    peg_rings,
    plate_boxes,
)
from palpate.simulation.work_cell.contour import FLAT, add_ball, add_contour

GRAVITY_M_S2: Final = 9.81
_FULL_INERTIA: Final = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
_RIGID_GYRATION_M2: Final = 4e-4
_SERVO_INTEGRAL_S: Final = 0.05  # integral time of the joint servos: assumed
_PEG: Final = 1  # collision groups: only peg against plate
_PLATE: Final = 2
_SHAFT_TYPES: Final = {"contype": 4, "conaffinity": 8}  # and the shaft against the mouth
_MOUTH_TYPES: Final = {"contype": 8, "conaffinity": 4}
_PLATE_RGBA: Final = (0.55, 0.6, 0.6, 1.0)
_PEG_RGBA: Final = (0.85, 0.55, 0.2, 1.0)
_ONLY_SEEN: Final[dict[str, Any]] = {"contype": 0, "conaffinity": 0, "mass": 0.0, "group": 2}
_SOLREF: Final = (CONTACT_TIME_S, 1.0)


def build_work_cell(
    kinematics: Kinematics,
    config: CellConfig,
    *,
    goal_in_base: pin.SE3,
    tool_yaw_rad: float,
    period_s: float,
    plate_reach_m: float = PLATE_REACH_M,
    listed: Leeway | None = None,
) -> mujoco.MjModel:
    """Build and compile the model.

    The model contains these names: bodies ``sensor``, ``peg``, ``plate``; actuators ``servo_1`` ...; sensors ``force``,
    ``torque`` at the sensor frame, ``tip_position`` for scoring; site ``tip``.

    Args:
        goal_in_base: Placement of the nominal goal (task frame) in the base frame; the plate starts there.
        tool_yaw_rad: Angle from the task's x axis to the tip's x axis about the task's z axis in the arm's ready pose;
            a non-round peg is gripped so that it fits the hole at this yaw.
        period_s: Control period; the time step is this period divided by ``config.substeps``.
        plate_reach_m: Distance from the hole's edge to the edge of the plate's closed surface.
        listed: Region within which only those sphere-box pairs that can touch are checked; None checks all contacts.
    """
    spec = mujoco.MjSpec()
    spec.modelname = f"palpate work cell, {kinematics.arm.name}"
    spec.option.timestep = period_s / config.substeps
    spec.option.gravity = (0.0, 0.0, -GRAVITY_M_S2)
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    spec.option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    spec.option.tolerance = 1e-10
    # Sparse Newton has a wrong Hessian in MuJoCo 4.0.0 (release notes of 4.0.1, #3767).
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    # With integrators that treat stiffness explicitly, the peg chatters against the wall of the hole at 5 substeps.
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    spec.compiler.degree = False
    spec.compiler.balanceinertia = True
    spec.worldbody.add_light(pos=(0.3, -0.5, 1.2), dir=(0.0, 0.4, -1.0))

    flange = _add_arm(spec, kinematics)
    _add_wrist(spec, flange, kinematics, config, tool_yaw_rad, _down_in_tip(goal_in_base, tool_yaw_rad))
    boxes = plate_boxes(config.peg, plate_reach_m)
    _add_plate(spec, config, goal_in_base, boxes)
    _add_sensors(spec, config)
    if config.contacts == "listed":
        _notify_place(spec)
    if listed is not None:
        _list_pairs(spec, config, boxes, listed)
    try:
        model = spec.compile()
    except ValueError as error:
        accepted = f"no URDF that MuJoCo can simulate ({' '.join(str(error).split())})"
        raise AssetError("arm", kinematics.arm.urdf, accepted) from error
    if listed is None:
        return model
    # Listed pairs are always checked; bodies without types have no other contacts.
    model.body_contype[:] = model.body_conaffinity[:] = 0
    return model


def _add_arm(spec: mujoco.MjSpec, kinematics: Kinematics) -> mujoco.MjsBody:
    """Add the arm's bodies, joints and servos; return the body with the flange."""
    model, (inertias, _) = kinematics.model, body_inertias(kinematics)
    stiffness, armature = servos(kinematics, inertias)
    axes = _joint_axes(model)
    bodies = {0: spec.worldbody}
    for index in range(1, model.njoints):
        j = index - 1
        parent, placement, inertia = bodies[model.parents[index]], model.jointPlacements[index], inertias[j]
        body = parent.add_body(
            name=f"link_{index}",
            pos=placement.translation,
            quat=quaternion(placement.rotation),
            mass=inertia.mass,
            ipos=inertia.lever,
            fullinertia=[float(inertia.inertia[at]) for at in _FULL_INERTIA],
            explicitinertial=True,
            gravcomp=1.0,
        )
        # The names in the URDF are not used: they may be missing or equal to those of the cell's joints.
        body.add_joint(
            name=f"joint_{index}",
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=axes[j],
            range=(float(kinematics.lower_rad[j]), float(kinematics.upper_rad[j])),
            limited=mujoco.mjtLimited.mjLIMITED_TRUE,
            armature=armature[j],
        )
        start, length = placement.translation, hypot(*placement.translation)
        if length > 0.02:
            parent.add_geom(
                type=mujoco.mjtGeom.mjGEOM_CAPSULE,
                fromto=(0.0, 0.0, 0.0, *start),
                size=(0.03, 0.0, 0.0),
                **_ONLY_SEEN,
                rgba=(0.75, 0.77, 0.8, 1.0),
            )
        servo = spec.add_actuator(name=f"servo_{index}", target=f"joint_{index}")
        servo.trntype = mujoco.mjtTrn.mjTRN_JOINT
        # Integral action as in industrial joint servos: without it, the arm yields by about 30 microradians under
        # the pressing force, and the gripper's springs turn that into a torque as large as that pointing at the hole.
        servo.set_to_pid(
            kp=stiffness[j],
            kv=2.0 * sqrt(stiffness[j] * armature[j]),
            ki=stiffness[j] / _SERVO_INTEGRAL_S,
            ctrlspec=int(mujoco.mjtCtrlInput.mjINPUT_POS),
        )
        bodies[index] = body
    return bodies[model.njoints - 1]


def _add_wrist(
    spec: mujoco.MjSpec,
    flange: mujoco.MjsBody,
    kinematics: Kinematics,
    config: CellConfig,
    tool_yaw_rad: float,
    down: tuple[float, float, float],
) -> None:
    """Add the force sensor, the gripper springs, and the peg."""
    tool, springs, peg = kinematics.tool, config.compliance, config.peg
    sensor_in_flange = kinematics.model.frames[kinematics.model.getFrameId("sensor")].placement
    # A body without joints: MuJoCo's force sensor reports the force between such a body and its parent.
    sensor = flange.add_body(
        name="sensor",
        pos=sensor_in_flange.translation,
        quat=quaternion(sensor_in_flange.rotation),
        mass=springs.rigid_mass_kg,
        ipos=(0.0, 0.0, 0.0),
        inertia=(springs.rigid_mass_kg * _RIGID_GYRATION_M2,) * 3,
        explicitinertial=True,
    )
    sensor.add_site(name="wrench", pos=(0.0, 0.0, 0.0))
    sensor.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=(0.03, 0.012, 0.0),
        **_ONLY_SEEN,
        rgba=(0.2, 0.45, 0.7, 1.0),
    )
    # The task's z points out of the tool like the tip's, so the yaw converts headings in the task to the tip's.
    turn_rad = config.tilt_heading_deg / 180.0 * np.pi - tool_yaw_rad
    tilt = config.tilt_mrad * 1e-3
    mass, length_m = springs.moving_mass_kg, hypot(*tool.tip_m)
    height_mm = springs.centre_of_mass_above_tip_mm
    # Squared radii of gyration, m^2, of a cylinder 2.6 h long and 0.35 h in radius.
    across, along = 6e-7 * height_mm**2, 6e-8 * height_mm**2
    body = sensor.add_body(
        name="peg",
        pos=kinematics.tip_in_sensor.translation,
        quat=_turned(kinematics, (cos(tilt / 2), -sin(tilt / 2) * sin(turn_rad), sin(tilt / 2) * cos(turn_rad), 0.0)),
        mass=mass,
        ipos=(0.0, 0.0, -height_mm * 1e-3),
        inertia=(mass * across, mass * across, mass * along),
        explicitinertial=True,
    )
    tilting_inertia = mass * (across + (height_mm * 1e-3 - springs.centre_above_tip_mm * 1e-3) ** 2)
    pivot = (0.0, 0.0, -springs.centre_above_tip_mm * 1e-3)
    lateral, axial = springs.lateral_N_per_mm * 1e3, springs.axial_N_per_mm * 1e3
    # Stationary above the hole the peg is in its kinematic pose: the springs are preloaded with its weight.
    fx, fy, fz = (mass * GRAVITY_M_S2 * each for each in down)
    tilt_lever_m = (height_mm - springs.centre_above_tip_mm) * 1e-3
    bent_x, bent_y = -tilt_lever_m * fy / springs.tilt_Nm_per_rad, tilt_lever_m * fx / springs.tilt_Nm_per_rad
    rows = (
        ("slide_x", mujoco.mjtJoint.mjJNT_SLIDE, (1.0, 0.0, 0.0), lateral, mass, -fx / lateral),
        ("slide_y", mujoco.mjtJoint.mjJNT_SLIDE, (0.0, 1.0, 0.0), lateral, mass, -fy / lateral),
        ("slide_z", mujoco.mjtJoint.mjJNT_SLIDE, (0.0, 0.0, 1.0), axial, mass, -fz / axial),
        ("tilt_x", mujoco.mjtJoint.mjJNT_HINGE, (1.0, 0.0, 0.0), springs.tilt_Nm_per_rad, tilting_inertia, bent_x),
        ("tilt_y", mujoco.mjtJoint.mjJNT_HINGE, (0.0, 1.0, 0.0), springs.tilt_Nm_per_rad, tilting_inertia, bent_y),
        ("turn_z", mujoco.mjtJoint.mjJNT_HINGE, (0.0, 0.0, 1.0), springs.torsion_Nm_per_rad, mass * along, 0.0),
    )  # fmt: skip
    for name, kind, axis, stiffness, inertia, rest in rows:
        body.add_joint(
            name=name, type=kind, axis=axis, pos=pivot, stiffness=(stiffness, 0.0, 0.0), springref=rest,
            damping=(2.0 * springs.damping_ratio * sqrt(stiffness * inertia), 0.0, 0.0),
            limited=mujoco.mjtLimited.mjLIMITED_FALSE,
        )  # fmt: skip
    touching = {"contype": _PEG, "conaffinity": _PLATE, "mass": 0.0, **_touching(config)}
    if config.contour.shape != FLAT:
        add_ball(body, config.contour, **touching)
    rim = peg.rim_radius_mm * 1e-3
    c, s = cos(-tool_yaw_rad), sin(-tool_yaw_rad)
    # The upper ring is a separate body: far above the plate its whole bounding volume is skipped at once.
    upper = body.add_body(name="peg_upper", mass=1e-6, inertia=(1e-12, 1e-12, 1e-12), explicitinertial=True)
    rings = peg_rings(peg) if config.contour.shape == FLAT and not peg.is_hull else ([], [])
    if config.has_shaft:
        rings = (rings[0], [])
        _add_cylinder(body, config, length_m / 2, **(touching | _SHAFT_TYPES))
    for ring, height, centres in zip((body, upper), (rim, UPPER_RING_M), rings, strict=True):
        for x, y in centres:
            ring.add_geom(
                type=mujoco.mjtGeom.mjGEOM_SPHERE,
                size=(rim, 0.0, 0.0),
                pos=(c * x - s * y, s * x + c * y, -height),
                group=3,
                **touching,
            )
    if peg.is_hull and config.contour.shape == FLAT:
        spec.add_mesh(name="peg", uservert=np.ravel(peg_corners(peg, length_m)))
        turn = (cos(tool_yaw_rad / 2), 0.0, 0.0, -sin(tool_yaw_rad / 2))
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname="peg",
            quat=turn,
            group=2,
            rgba=_PEG_RGBA,
            **touching,
        )
    else:
        _add_cylinder(body, config, length_m / 2)
    body.add_site(name="tip", pos=(0.0, 0.0, 0.0))


def _add_cylinder(body: mujoco.MjsBody, config: CellConfig, length: float, **touching: Any) -> None:
    """Add the shaft, either for display only or to touch the mouth of the hole from just above the rim spheres."""
    peg = config.peg
    start = 2e-3 * peg.rim_radius_mm if touching else 0.0
    radius_mm = peg.diameter_mm * 0.5 if config.contour.shape == FLAT else 0.8 * config.contour.ball_radius_mm
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=(radius_mm * 1e-3, length, 0.0),
        pos=(0.0, 0.0, -length - start),
        **(touching | {"group": 3} if touching else _ONLY_SEEN),
        rgba=_PEG_RGBA,
    )


def _add_plate(spec: mujoco.MjSpec, config: CellConfig, goal_in_base: pin.SE3, boxes: list[Box]) -> None:
    """Add the plate with its hole, in the task frame: z into the hole, surface at 0."""
    upright = quaternion(goal_in_base.rotation)
    plate = spec.worldbody.add_body(name="plate", pos=goal_in_base.translation, quat=upright)
    touching = {"contype": _PLATE, "conaffinity": _PEG, "rgba": _PLATE_RGBA, **_touching(config)}
    if config.contour.shape != FLAT:
        add_contour(plate, config.contour, **touching)
        return
    radius = config.peg.rim_radius_mm * 1e-3
    for x, y in mouth_ring(config.peg) if config.has_shaft else ():
        plate.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=(radius, 0.0, 0.0),
            pos=(x, y, radius),
            group=3,
            **(touching | _MOUTH_TYPES),
        )
    for box in boxes:
        half_heading = box.heading_rad / 2
        plate.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=box.half_m,
            pos=(cos(box.heading_rad) * box.distance_m, sin(box.heading_rad) * box.distance_m, box.depth_m),
            quat=(cos(half_heading), 0.0, 0.0, sin(half_heading)),
            **touching,
        )


def _touching(config: CellConfig) -> dict[str, Any]:
    """Return the contact parameters for the peg and the plate."""
    return {
        "condim": 3,
        "friction": (config.peg.friction, 0.0, 0.0),
        "solref": _SOLREF,
        "solimp": contact_impedance(config),
    }


def _list_pairs(spec: mujoco.MjSpec, config: CellConfig, boxes: list[Box], leeway: Leeway) -> None:
    """Add the sphere-box pairs that can touch for a peg within the region."""
    rings, plate = (spec.body("peg"), spec.body("peg_upper")), list(spec.body("plate").geoms)
    mouth = [geom for geom in plate if geom.type == mujoco.mjtGeom.mjGEOM_SPHERE]
    spheres = [geom for body in rings for geom in body.geoms if geom.type == mujoco.mjtGeom.mjGEOM_SPHERE]
    shaft = [geom for geom in rings[0].geoms if geom.contype == _SHAFT_TYPES["contype"]]
    solids = [geom for geom in plate if geom.type == mujoco.mjtGeom.mjGEOM_BOX]
    for name, geoms in (("sphere", spheres), ("box", solids), ("mouth", mouth), ("shaft", shaft)):
        for number, geom in enumerate(geoms):
            geom.name = f"{name}_{number}"
    pairs = [(spheres[sphere], solids[box]) for sphere, box in listed_pairs(config, boxes, leeway)]
    for one, other in (*pairs, *product(shaft, mouth)):
        spec.add_pair(
            geomname1=one.name,
            geomname2=other.name,
            condim=3,
            friction=(config.peg.friction, config.peg.friction, 0.0, 0.0, 0.0),
            solref=_SOLREF,
            solimp=contact_impedance(config),
        )


def _notify_place(spec: mujoco.MjSpec) -> None:
    """Add sensors for the tip pose, which determines the contacts to check."""
    for name, kind in (
        ("tip_in_plate", mujoco.mjtSensor.mjSENS_FRAMEPOS),
        ("tip_x_in_plate", mujoco.mjtSensor.mjSENS_FRAMEXAXIS),
        ("tip_z_in_plate", mujoco.mjtSensor.mjSENS_FRAMEZAXIS),
    ):
        spec.add_sensor(
            name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="tip",
            reftype=mujoco.mjtObj.mjOBJ_XBODY, refname="plate",
        )  # fmt: skip
    # One peg on one plate is one island: searching for more takes time and has no effect.
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ISLAND)


def _add_sensors(spec: mujoco.MjSpec, config: CellConfig) -> None:
    site = mujoco.mjtObj.mjOBJ_SITE
    # The history holds every physics step of a tick, so that peaks between control ticks are included.
    for name, kind in (("force", mujoco.mjtSensor.mjSENS_FORCE), ("torque", mujoco.mjtSensor.mjSENS_TORQUE)):
        sensor = spec.add_sensor(name=name, type=kind, objtype=site, objname="wrench")
        if name == "force":
            sensor.nsample = config.substeps
    spec.add_sensor(name="tip_position", type=mujoco.mjtSensor.mjSENS_FRAMEPOS, objtype=site, objname="tip")


def _joint_axes(model: pin.Model) -> list[tuple[float, float, float]]:
    """Return the axis of each joint in its own frame, computed from its motion for any Pinocchio joint type."""
    data = model.createData()
    axes = []
    for index in range(1, model.njoints):
        q = pin.neutral(model)
        pin.forwardKinematics(model, data, q)
        before = data.oMi[index].copy()
        q[index - 1] = 1.0
        pin.forwardKinematics(model, data, q)
        x, y, z = pin.log3(before.actInv(data.oMi[index]).rotation).tolist()
        axes.append((x, y, z))
    return axes


def quaternion(rotation: np.ndarray) -> tuple[float, float, float, float]:
    """Convert a rotation matrix, (3, 3), to a MuJoCo quaternion: w, x, y, z."""
    x, y, z, w = pin.Quaternion(rotation).coeffs().tolist()
    return w, x, y, z


def _down_in_tip(goal_in_base: pin.SE3, tool_yaw_rad: float) -> tuple[float, float, float]:
    """Return the direction of gravity in the tip frame, with the tool along the hole."""
    x, y, z = (-goal_in_base.rotation[2]).tolist()
    c, s = cos(tool_yaw_rad), sin(tool_yaw_rad)
    return c * x + s * y, c * y - s * x, z


def _turned(kinematics: Kinematics, tilt: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """Return a tilted peg's orientation in the sensor frame as a quaternion: w, x, y, z."""
    if not any(kinematics.tool.tip_rpy_rad):
        return tilt
    w, x, y, z = tilt
    return quaternion(kinematics.tip_in_sensor.rotation @ pin.Quaternion(w, x, y, z).toRotationMatrix())
