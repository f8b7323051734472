"""The cell of a trial as Rerun's shapes, by frame, and where the frames are."""

from dataclasses import replace
from typing import Any, Final, TypeAlias

import mujoco
import numpy as np
import rerun as rr

from palpate.adapters.log import TrialLog
from palpate.adapters.mujoco import DrawnCell, Moment

BASE: Final = "base"
_SPHERES_OF_CONTACT: Final = 3
"""Group of the spheres by which the peg touches: too small to be seen."""
_M_PER_N: Final = 0.015
"""Length of the arrow for a force."""
Row: TypeAlias = tuple[float, ...]


class CellShapes:
    """What stands where in a cell.

    Attributes:
        shapes: For each frame its shapes by name.

    Raises:
        LogError: The log does not hold what the cell looked like.
    """

    def __init__(self, log: TrialLog) -> None:
        self._cell = DrawnCell(log)
        model = self._cell.model
        self._names = [BASE, *(str(model.body(body).name) for body in range(1, model.nbody))]
        self._task_in_base = self._cell.goal_in_base.inverse()
        self.shapes: dict[str, dict[str, Any]] = {name: {} for name in self._names}
        for geom in range(model.ngeom):
            shape = None if int(model.geom_group[geom]) == _SPHERES_OF_CONTACT else _shape(model, geom)
            if shape is not None:
                self.shapes[self._names[int(model.geom_bodyid[geom])]][f"shape_{geom}"] = shape

    def at(self, moment: Moment) -> tuple[dict[str, tuple[Row, Row]], tuple[Row, Row] | None, Row]:
        """Return the frames, the force and the tip.

        Returns:
            Position (3,) in m and quaternion (w, x, y, z) of each frame, base frame; origin and vector of the force's
            arrow, base frame, m; and the tip by the encoders, task frame, (3,) in mm.
        """
        cell = self._cell
        # By the encoders, as everywhere: they do not measure how the gripper is bent.
        cell.pose(replace(moment, force_N=None, torque_Nm=None))
        tip_mm = tuple((self._task_in_base.act(cell.tip_m) * 1e3).tolist())
        cell.pose(moment)
        positions, turns = cell.data.xpos.tolist(), cell.data.xquat.tolist()
        frames = {name: (positions[body], turns[body]) for body, name in enumerate(self._names) if body}
        tip, force = cell.tip_m, cell.force_in_base(moment)
        arrow = None
        if force is not None:
            # It ends where it acts: beyond, it would run within the peg.
            vector = force * _M_PER_N
            arrow = tuple((tip - vector).tolist()), tuple(vector.tolist())
        return frames, arrow, tip_mm


def _shape(model: mujoco.MjModel, geom: int) -> Any:
    a, b, c = model.geom_size[geom].tolist()
    w, x, y, z = model.geom_quat[geom].tolist()
    colour = tuple(round(255 * part) for part in model.geom_rgba[geom].tolist())
    solid: dict[str, Any] = {"colors": colour, "quaternions": [(x, y, z, w)], "fill_mode": "solid"}
    centre = [model.geom_pos[geom].tolist()]
    match int(model.geom_type[geom]):
        case mujoco.mjtGeom.mjGEOM_BOX:
            return rr.Boxes3D(half_sizes=[(a, b, c)], centers=centre, **solid)
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            return rr.Ellipsoids3D(half_sizes=[(a, a, a)], centers=centre, **solid)
        case mujoco.mjtGeom.mjGEOM_CYLINDER | mujoco.mjtGeom.mjGEOM_CAPSULE:
            return rr.Cylinders3D(lengths=[2 * b], radii=[a], centers=centre, **solid)
        case mujoco.mjtGeom.mjGEOM_MESH:
            turn = np.empty(9)
            mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
            corners = model.geom_pos[geom] + model.mesh_vert[model.mesh_face.ravel()] @ turn.reshape(3, 3).T
            return rr.Mesh3D(vertex_positions=corners, albedo_factor=colour)
    return None
