"""The cell of a trial as shapes in frames."""

from typing import Final

import mujoco
import numpy as np

from palpate.adapters.log import TrialLog
from palpate.adapters.mujoco import DrawnCell, Moment
from palpate.adapters.visualisation.live.display import BASE, Pose, Row, Shape

_KINDS: Final = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
}
_FEELERS: Final = 3
"""Group of the spheres by which the peg touches: too small to be seen."""
_M_PER_N: Final = 0.015
"""Length of the arrow that is drawn for a force."""


class CellFrames:
    """Where everything of a cell is, moment by moment."""

    def __init__(self, log: TrialLog) -> None:
        self._cell = DrawnCell(log)
        model = self._cell.model
        names = [str(model.body(body).name) for body in range(model.nbody)]
        self._names = [BASE, *names[1:]]
        self._task_in_base = self._cell.goal_in_base.inverse()
        self.bodies: dict[str, list[Shape]] = {name: [] for name in self._names}
        for geom in range(model.ngeom):
            kind = _KINDS.get(int(model.geom_type[geom]))
            if kind is None or int(model.geom_group[geom]) == _FEELERS:
                continue
            a, b, c = model.geom_size[geom].tolist()
            half = (a, b, c) if kind == "box" else (a, a, a if kind == "sphere" else b)
            place, turn, rgba = (
                tuple(table[geom].tolist()) for table in (model.geom_pos, model.geom_quat, model.geom_rgba)
            )
            corners = _corners(model, geom) if kind == "mesh" else ()
            shape = Shape(kind, half, place, turn, rgba, corners)
            self.bodies[self._names[int(model.geom_bodyid[geom])]].append(shape)

    def at(self, moment: Moment) -> tuple[dict[str, Pose], tuple[Row, Row] | None, Row]:
        """The frames in the base; the force as an arrow; and the tip in the task frame, mm."""
        cell = self._cell
        cell.pose(moment)
        positions, turns = cell.data.xpos.tolist(), cell.data.xquat.tolist()
        frames = {
            name: Pose(tuple(positions[body]), tuple(turns[body])) for body, name in enumerate(self._names) if body
        }
        tip, force = cell.tip_m, cell.force_in_base(moment)
        arrow = None
        if force is not None:
            # It ends where it acts: from there on it would run within the peg.
            vector = force * _M_PER_N
            arrow = tuple((tip - vector).tolist()), tuple(vector.tolist())
        return frames, arrow, tuple((self._task_in_base.act(tip) * 1e3).tolist())


def _corners(model: mujoco.MjModel, geom: int) -> tuple[Row, ...]:
    """Corners of the only mesh's triangles, in the frame of the body that it belongs to."""
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    corners = model.geom_pos[geom] + model.mesh_vert[model.mesh_face.ravel()] @ turn.reshape(3, 3).T
    return tuple(tuple(corner) for corner in corners.tolist())
