"""Pictures of a running episode, by the means that draw recorded trials."""

from copy import deepcopy
from typing import Any, Final

import mujoco
import numpy as np

from palpate.adapters.config import RunConfig
from palpate.adapters.mujoco import DrawnCell, Stage
from palpate.simulation.work_cell import WorkCell

SIZE: Final = (640, 480)
"""Width and height in pixels."""


class RunningCell(DrawnCell):
    """The simulated cell itself, as it stands. Drawn from a copy of its model, which colours and cuts may change."""

    def __init__(self, config: RunConfig, cell: WorkCell) -> None:
        self._source, self._plate = cell, cell.model.body("plate").id
        self.model = deepcopy(cell.model)
        self.data = mujoco.MjData(self.model)
        self.hole_known, self.joints = True, cell.joints
        peg = config.cell.peg
        self.peg_diameter_m = peg.diameter_mm * 1e-3
        self.peg, self.contour = peg, config.cell.contour.shape != "none"
        self.plate_depth_m = peg.hole_depth_mm * 1e-3 + 0.005
        self.follow()

    def follow(self) -> None:
        """Stand as the simulated cell does now."""
        self._source.pose(self.model, self.data)
        self.mouth_m = self.model.body_pos[self._plate].copy()


class Camera:
    """Takes close-ups of peg and hole, the plate cut open; :meth:`close` it when done.

    Raises:
        UsageError: There is no graphics library that works.
    """

    def __init__(self, config: RunConfig, cell: WorkCell) -> None:
        self._cell = RunningCell(config, cell)
        self._stage = Stage(self._cell, SIZE)

    def picture(self) -> np.ndarray[Any, np.dtype[np.uint8]]:
        """The cell now, (480, 640, 3), 8 bits a colour."""
        self._cell.follow()
        view = self._cell.close_up()
        return np.ascontiguousarray(self._stage.picture(view, *SIZE))

    def close(self) -> None:
        """Let the graphics library go."""
        self._stage.close()
