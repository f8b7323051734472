"""Which contacts are looked for, tick by tick: none high above the plate, the listed pairs near the hole, else all.

Listed pairs save most of the search and give the same contacts. They are complete only near the hole, so a tick that
ends where they are not is done over with a search for everything: nothing goes through the plate for want of a pair.
"""

from __future__ import annotations

from enum import IntEnum
from math import cos, hypot, sin
from typing import Final

import mujoco
import numpy as np

from palpate.simulation.work_cell.contact_pairs import Leeway
from palpate.simulation.work_cell.contact_shapes import UPPER_RING_M

_CLEAR_M: Final = 1e-3
_STATE: Final = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_NO_CONTACT: Final = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)


class Search(IntEnum):
    """What is looked for; a greater one finds whatever a smaller one does."""

    NOTHING = 0
    LISTED = 1
    EVERYTHING = 2


class ContactSearch:
    """Lets physics go on, looking for as few contacts as can be.

    Args:
        model: A cell with listed pairs.
        data: Its state.
        leeway: Where the listed pairs are complete.
        radius_m: Distance of the peg's outermost sphere from its axis.
        yaw_rad: Angle from the plate's x to the tip's x about the plate's z, as the arm holds the tool.

    Attributes:
        search: What was looked for in the newest step.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, leeway: Leeway, radius_m: float, yaw_rad: float
    ) -> None:
        self._model, self._data, self._leeway, self._radius_m = model, data, leeway, radius_m
        self._across = -sin(yaw_rad), cos(yaw_rad)
        start = int(model.sensor("tip_in_plate").adr[0])
        # Position, x axis and z axis of the tip at the newest physics step, where contacts were looked for.
        self._pose = data.sensordata[start : start + 9]
        self._before = np.empty(mujoco.mj_stateSize(model, _STATE))
        self._bodies = [model.body(name).id for name in ("peg", "peg_upper")]
        self._types = model.body_contype[self._bodies], model.body_conaffinity[self._bodies]
        self.search = self._next = Search.EVERYTHING

    def forward(self) -> None:
        """Find out all about a state that was just set."""
        self.look_for(Search.EVERYTHING)
        mujoco.mj_forward(self._model, self._data)
        self._next = self._needed()

    def step(self, steps: int) -> None:
        """So many physics steps."""
        model, data = self._model, self._data
        if self._next is not self.search:
            self.look_for(self._next)
        mujoco.mj_getState(model, data, self._before, _STATE)
        mujoco.mj_step(model, data, nstep=steps)
        while (needed := self._needed()) > self.search:
            self.look_for(needed)
            mujoco.mj_setState(model, data, self._before, _STATE)
            mujoco.mj_step(model, data, nstep=steps)
        self._next = needed

    def look_for(self, search: Search) -> None:
        """Look for this from the next step on."""
        model = self._model
        self.search = search
        if search is Search.NOTHING:
            model.opt.disableflags |= _NO_CONTACT
            return
        model.opt.disableflags &= ~_NO_CONTACT
        # MuJoCo tries listed pairs in any case; bodies without types collide in no other.
        types, affinities = self._types if search is Search.EVERYTHING else (0, 0)
        model.body_contype[self._bodies] = types
        model.body_conaffinity[self._bodies] = affinities

    def _needed(self) -> Search:
        """The least that finds every contact where the peg was at the newest physics step."""
        x, y, z, along, across, _, lean_x, lean_y, down = self._pose.tolist()
        lean, leeway = hypot(lean_x, lean_y), self._leeway
        lowest = z + self._radius_m * lean
        if lowest < -_CLEAR_M and down > 0.0:
            return Search.NOTHING
        aside = hypot(x, y)
        if aside > leeway.aside_m or lean > leeway.lean or down < 0.0:
            return Search.EVERYTHING
        if abs(along * self._across[0] + across * self._across[1]) > leeway.turn:
            return Search.EVERYTHING
        if lowest > UPPER_RING_M - _CLEAR_M and aside + UPPER_RING_M * lean > leeway.play_m:
            return Search.EVERYTHING
        return Search.LISTED
