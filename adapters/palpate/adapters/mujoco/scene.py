"""Lit cell model for images, posed from recorded joint angles, with a table below it."""

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Final

import mujoco
import numpy as np
import pinocchio as pin

from palpate.adapters.log import DecisionEntry, TrialLog, config_of, json_in
from palpate.adapters.mujoco.graphics import off_screen_context
from palpate.adapters.mujoco.views import FIELD_OF_VIEW_DEG, Array, View, close_up, whole_arm
from palpate.core.errors import LogError, PalpateError
from palpate.core.motion import Kinematics, arm_named, rotated, wrench_about
from palpate.core.ports import CONTROL_RATE_HZ, JointVector, Vector3
from palpate.core.trial import goal_in_base, wander_m
from palpate.simulation.work_cell import build_work_cell, quaternion, trial_world


@dataclass(frozen=True)
class Moment:
    """Values known at a tick.

    Attributes:
        force_N: Tared force on the tool, (3,), sensor frame, or None if not measured.
        torque_Nm: Torque about the sensor's origin, (3,), or None if ``force_N`` is None.
        decision: The current action and its reason, or None if there is no action.
    """

    tick: int
    time_s: float
    joints_rad: JointVector
    force_N: Vector3 | None
    torque_Nm: Vector3 | None
    phase: str
    decision: DecisionEntry | None


_CUT_GROUP: Final = 4
_BACKDROP: Final = (0.70, 0.74, 0.78, 1.0)
_FLOOR: Final = (0.62, 0.67, 0.72, 1.0)
_TABLE: Final = (0.45, 0.50, 0.55, 1.0)
_METAL: Final = (0.56, 0.61, 0.66, 1.0)
_WALL: Final = (0.36, 0.47, 0.56, 1.0)
_ARM: Final = (0.76, 0.77, 0.80, 1.0)
_SENSOR: Final = (0.16, 0.40, 0.68, 1.0)
_PEG: Final = (0.90, 0.72, 0.38, 1.0)
_WRIST_M: Final = 0.024
"""Radius of the link to the sensor, which the physical model lacks."""
_TURNED_DEG: Final = 25.0
# Camera angle about pegs with corners.
_SPRINGS: Final = ("slide_x", "slide_y", "slide_z", "tilt_x", "tilt_y", "turn_z")
_MOST_BENT: Final = np.array([0.02, 0.02, 0.02, 0.2, 0.2, 0.2])
_MOST_GEOMS: Final = 2000


class DrawnCell:
    """Geometry for the cell in a log, without graphics. If ``hole_known``, the hole is drawn at its true position.

    Raises:
        LogError: The log does not describe the cell completely.
    """

    def __init__(self, log: TrialLog) -> None:
        config = config_of(log)
        goal = goal_in_base(config.task.goal)
        world = trial_world(config.cell, log.start.seed, log.start.trial)
        # The peg is drawn in its true shape, whatever its contact model.
        cell = replace(world.cell, peg=replace(world.cell.peg, contact="hull"))
        try:
            kinematics = Kinematics(arm_named(config.arm), config.tool.geometry)
            yaw = goal.rotation.T @ np.array(log.start.tip_rotation).reshape(3, 3)[:, 0]
            if not np.isfinite(yaw).all():
                raise ValueError("the tool's orientation is none")
            self.model = build_work_cell(
                kinematics,
                cell,
                goal_in_base=goal,
                tool_yaw_rad=float(np.arctan2(yaw[1], yaw[0])),
                period_s=1.0 / CONTROL_RATE_HZ,
                plate_reach_m=cell.plate_reach_m(wander_m(config.task)),
            )
        except (PalpateError, ValueError) as error:
            problem = f"does not describe the cell ({error})"
            raise LogError(log.path, "/start", problem, "it cannot be drawn") from error
        hole = true_hole_m(log)
        self.hole_known = hole is not None
        self.joints = kinematics.joints
        self.data = mujoco.MjData(self.model)
        self.goal_in_base = goal
        self.mouth_m: Array = goal.act(np.zeros(3) if hole is None else np.array(hole))
        self.peg_diameter_m = cell.peg.diameter_mm * 1e-3
        self.peg = cell.peg
        self.plate_depth_m = cell.peg.hole_depth_mm * 1e-3 + 0.005
        self._compliance, to_sensor = cell.compliance, kinematics.tip_in_sensor
        self._to_tip, self._lever_m = to_sensor.rotation.T.tolist(), (-to_sensor.inverse().translation).tolist()
        plate = self.model.body("plate").id
        self.model.body_pos[plate] = self.mouth_m
        self.model.body_quat[plate] = quaternion(goal.rotation @ pin.exp3(np.array(world.hole_turn_rad)))
        self._springs = [int(self.model.joint(name).qposadr[0]) for name in _SPRINGS]
        self._path, self.contour = log.path, cell.contour.shape != "none"

    def pose(self, moment: Moment) -> None:
        """Move the arm and the spring-mounted peg to their poses at a given time.

        The encoders do not measure the gripper springs, so the spring deflection is computed from the measured wrench.

        Raises:
            LogError: The arm has a different number of joints.
        """
        if len(moment.joints_rad) != self.joints:
            problem = f"has {len(moment.joints_rad)} joint angles, its arm {self.joints} joints"
            raise LogError(self._path, f"tick {moment.tick}", problem, "it cannot be drawn")
        self.data.qpos[:] = 0.0
        self.data.qpos[: self.joints] = moment.joints_rad
        # Limited to a gripper's deflection: an implausible force must not displace the peg in the picture.
        self.data.qpos[self._springs] = np.clip(self._bent(moment), -_MOST_BENT, _MOST_BENT)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def _bent(self, moment: Moment) -> tuple[float, ...]:
        if moment.force_N is None or moment.torque_Nm is None:
            return (0.0,) * len(_SPRINGS)
        springs, (fx, fy, fz) = self._compliance, rotated(self._to_tip, moment.force_N)
        x, y, z = self._lever_m
        pivot = (x, y, z - springs.centre_above_tip_mm * 1e-3)
        tx, ty, tz = wrench_about((fx, fy, fz), rotated(self._to_tip, moment.torque_Nm), pivot)
        lateral, axial = springs.lateral_N_per_mm * 1e3, springs.axial_N_per_mm * 1e3
        tilt = springs.tilt_Nm_per_rad
        return fx / lateral, fy / lateral, fz / axial, tx / tilt, ty / tilt, tz / springs.torsion_Nm_per_rad

    @property
    def tip_m(self) -> Array:
        """Centre of the peg's end face, (3,), base frame."""
        tip: Array = self.data.site("tip").xpos.copy()
        return tip

    def force_in_base(self, moment: Moment) -> Array | None:
        """Return the measured force on the tool, (3,) N, base frame, or None if it was not measured."""
        if moment.force_N is None:
            return None
        rotation = self.data.body("sensor").xmat.reshape(3, 3)
        turned: Array = rotation @ np.array(moment.force_N)
        return turned

    def views(self) -> tuple[View, View]:
        """Return a close-up view and a view of the whole arm in its current pose."""
        points = np.vstack((self.data.xpos, self.mouth_m, self.tip_m))
        return self.close_up(), whole_arm(points)

    def close_up(self) -> View:
        """Return a side view of the peg and the hole."""
        return close_up(self.mouth_m, self.peg_diameter_m, 0.0 if self.peg.cross_section == "round" else _TURNED_DEG)

    def rim_m(self, points: int) -> Array:
        """Return evenly spaced points on the hole's rim where the plate is cut away, (2 n, 3), base frame."""
        outline = np.array(self.peg.section(self.peg.clearance_mm).outline(points))
        closed = np.vstack((outline, outline[:1]))
        along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1)))
        even = np.linspace(0.0, along[-1], 2 * points, endpoint=False)
        x, y = (np.interp(even, along, closed[:, axis]) for axis in (0, 1))
        near = sorted(zip(np.arctan2(y, x).tolist(), x.tolist(), y.tolist(), strict=True))
        plate = self.data.body("plate")
        in_plate = np.array([(x, y, 0.0) for heading, x, y in near if heading >= 0.0])
        rim: Array = plate.xpos + in_plate @ plate.xmat.reshape(3, 3).T
        return rim[len(rim) % 2 :]


def true_hole_m(log: TrialLog) -> tuple[float, float, float] | None:
    """Return the true hole position, (3,), task frame, or None if it is unknown."""
    found: Any = None
    with suppress(LogError):
        found = json_in(log, "start.world_json", log.start.world_json).get("hole_in_task_m")
    if found is None and log.end is not None:
        found = log.end.true_hole_in_task_m
    if not isinstance(found, (list, tuple)) or len(found) != 3:
        return None
    if not all(isinstance(value, (int, float)) and np.isfinite(value) for value in found):
        return None
    x, y, z = map(float, found)
    return x, y, z


class Stage:
    """A cell with lights and a camera, for images up to a given size in pixels. :meth:`close` it after use.

    Raises:
        UsageError: No OpenGL backend works.
    """

    def __init__(self, cell: DrawnCell, size: tuple[int, int]) -> None:
        self.cell = cell
        model = cell.model
        self._dress()
        model.vis.global_.offwidth, model.vis.global_.offheight = size
        model.vis.global_.fovy = FIELD_OF_VIEW_DEG
        # Software renderers, usual on machines without a display, spend most of their time on shadows.
        model.vis.quality.shadowsize = 2048
        model.vis.quality.offsamples = 4
        self._gl = off_screen_context(*size)
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._scene = mujoco.MjvScene(model, maxgeom=_MOST_GEOMS)
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = 1
        self._option.geomgroup[3] = 0
        self._option.sitegroup[:] = 0

    def _dress(self) -> None:
        """Set the colours, the lights, and the part of the plate that is cut away."""
        cell, model = self.cell, self.cell.model
        model.vis.map.znear, model.vis.map.zfar = 0.005, 60.0
        model.vis.headlight.ambient[:] = 0.42
        model.vis.headlight.diffuse[:] = 0.38
        model.vis.headlight.specular[:] = 0.1
        plate, sensor, peg = (model.body(name).id for name in ("plate", "sensor", "peg"))
        # The plate has two rings of boxes; the first, inner one is the hole's wall. A contour has none.
        walls = 0 if cell.contour else cell.peg.walls
        for geom in range(model.ngeom):
            body = int(model.geom_bodyid[geom])
            if body == plate:
                model.geom_rgba[geom] = _WALL if geom - int(model.body_geomadr[body]) < walls else _METAL
                # The plate's y is the base's -y: towards the camera.
                model.geom_group[geom] = _CUT_GROUP if model.geom_pos[geom][1] > 1e-6 else 0
            else:
                model.geom_rgba[geom] = _SENSOR if body == sensor else _PEG if body == peg else _ARM

    def picture(self, view: View, width: int, height: int) -> np.ndarray:
        """Return an image of the cell in its current pose, (height, width, 3), 8 bits per colour."""
        camera = mujoco.MjvCamera()
        camera.lookat[:] = view.target_m
        camera.distance, camera.azimuth, camera.elevation = view.distance_m, view.azimuth_deg, view.elevation_deg
        self._option.geomgroup[_CUT_GROUP] = not view.cut
        scene, cell = self._scene, self.cell
        mujoco.mjv_updateScene(
            cell.model, cell.data, self._option, mujoco.MjvPerturb(), camera, mujoco.mjtCatBit.mjCAT_ALL, scene
        )
        self._add_backdrop(view)
        if not view.cut:
            self._add_surroundings()
        # In the close-up, the many small boxes around the hole would show a shadow at every seam.
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = not view.cut
        self._gl.make_current()
        rect = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(rect, scene, self._context)
        pixels = np.empty((height, width, 3), np.uint8)
        mujoco.mjr_readPixels(pixels, None, rect, self._context)
        return pixels[::-1]

    def _add_backdrop(self, view: View) -> None:
        """Add a wall far behind the cell, perpendicular to the line of sight. Without it the background is black."""
        right, up, forward = view.axes
        far_m = view.distance_m + 8.0
        middle = np.array(view.target_m) + forward * (far_m - view.distance_m)
        facing = np.column_stack((right, up, -forward))
        # It emits light, so that it looks the same from every direction.
        self._add(mujoco.mjtGeom.mjGEOM_BOX, (far_m, far_m, 0.01), middle, facing, _BACKDROP).emission = 0.4

    def _add_surroundings(self) -> None:
        """Add a floor, a block below the plate, and the link between the arm's last joint and the sensor."""
        cell = self.cell
        bottom = float(cell.mouth_m[2]) - cell.plate_depth_m
        floor = min(0.0, bottom - 0.01)
        upright = np.eye(3)
        self._add(mujoco.mjtGeom.mjGEOM_BOX, (1.2, 1.2, 0.01), np.array([0.2, 0.0, floor - 0.01]), upright, _FLOOR)
        half = 2.5 * cell.peg_diameter_m
        middle = np.array([*cell.mouth_m[:2], (floor + bottom) / 2.0])
        block = (half, half, (bottom - floor) / 2.0)
        self._add(mujoco.mjtGeom.mjGEOM_BOX, block, middle, upright, _TABLE)
        self._add(
            mujoco.mjtGeom.mjGEOM_CYLINDER, (0.07, 0.07, 0.02), np.array([0.0, 0.0, floor + 0.02]), upright, _TABLE
        )
        wrist, sensor = cell.data.body(f"link_{cell.joints}").xpos, cell.data.body("sensor").xpos
        link = self._add(mujoco.mjtGeom.mjGEOM_CAPSULE, (_WRIST_M,) * 3, wrist, upright, _ARM)
        mujoco.mjv_connector(link, mujoco.mjtGeom.mjGEOM_CAPSULE, _WRIST_M, wrist, sensor)

    def _add(
        self,
        kind: mujoco.mjtGeom,
        size: tuple[float, float, float],
        middle: Array,
        axes: Array,
        rgba: tuple[float, float, float, float],
    ) -> Any:
        scene = self._scene
        geom = scene.geoms[scene.ngeom]
        colour = np.array(rgba, np.float32)
        mujoco.mjv_initGeom(geom, kind, np.array(size), np.asarray(middle, np.float64), axes.flatten(), colour)
        scene.ngeom += 1
        return geom

    def close(self) -> None:
        """Release the OpenGL context."""
        self._gl.make_current()
        self._context.free()
        self._gl.free()
