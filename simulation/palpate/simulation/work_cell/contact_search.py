"""Select the contacts to check in a tick: none high above the plate, listed pairs near the hole, otherwise all.

Listed pairs avoid most of the search and yield the same contacts. A list is complete only near the hole; a tick that
ends outside its region is repeated with a longer list, so that no contact is missed.
"""

from collections.abc import Sequence
from math import cos, hypot, sin
from typing import Final

import mujoco
import numpy as np

from palpate.simulation.work_cell.contact_pairs import Leeway
from palpate.simulation.work_cell.contact_shapes import UPPER_RING_M

_CLEAR_M: Final = 1e-3


class ContactSearch:
    """Search that advances the physics with as few contact checks as possible.

    It has several models for the same cell that differ only in the contacts to check, so that all can start from one
    state. A level is the index of a model; a higher level finds all contacts of a lower level.

    Args:
        listed: Cell with the listed pairs for each region, narrowest region first.
        radius_m: Distance of the peg's outermost sphere from its axis.
        yaw_rad: Angle from the plate's x axis to the tip's x axis about the plate's z axis.

    Attributes:
        level: Level used in the latest step.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        listed: Sequence[tuple[Leeway, mujoco.MjModel]],
        data: mujoco.MjData,
        radius_m: float,
        yaw_rad: float,
    ) -> None:
        nothing = model.__copy__()
        nothing.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        self.models = [nothing, *(each for _, each in listed), model]
        self._leeways = [leeway for leeway, _ in listed]
        self._data, self._radius_m = data, radius_m
        self._across = -sin(yaw_rad), cos(yaw_rad)
        start = int(model.sensor("tip_in_plate").adr[0])
        # Position, x axis and z axis of the tip at the latest physics step, in which contacts were checked.
        self._pose = data.sensordata[start : start + 9]
        # The complete state of a step except the time, as MuJoCo's own arrays.
        self._state = data.qpos, data.qvel, data.act, data.history, data.qacc_warmstart
        # Stored as separate bytes: mj_getState takes 3 us more between physics steps, a twentieth of a tick.
        self._kept = tuple(each.tobytes for each in self._state)
        self._plate = model.body("plate").id
        self.level = self._next = self._highest = len(listed) + 1

    def begin(self) -> None:
        """Initialise after a state has been set; the plate's position is taken from the highest-level model."""
        everything = self.models[-1]
        for model in self.models:
            model.body_pos[self._plate] = everything.body_pos[self._plate]
            model.body_quat[self._plate] = everything.body_quat[self._plate]
        mujoco.mj_forward(everything, self._data)
        self._next = self._needed()

    def step(self, steps: int) -> None:
        """Perform n physics steps."""
        data, self.level = self._data, self._next
        if self.level < self._highest:
            position, velocity, activation, history, guess = self._kept
            before = data.time, position(), velocity(), activation(), history(), guess()
        # Positional arguments, because with a keyword argument the call takes three times as long.
        mujoco.mj_step(self.models[self.level], data, steps)
        while (needed := self._needed()) > self.level:
            self.level = needed
            data.time = before[0]
            for array, kept in zip(self._state, before[1:], strict=True):
                array[:] = np.frombuffer(kept)
            mujoco.mj_step(self.models[needed], data, steps)
        self._next = needed

    def _needed(self) -> int:
        """Return the lowest level that finds every contact for the peg's pose in the latest physics step."""
        x, y, z, along, across, _, tilt_x, tilt_y, down = self._pose.tolist()
        tilt = hypot(tilt_x, tilt_y)
        lowest = z + self._radius_m * tilt
        if down <= 0.0:
            return self._highest
        if lowest < -_CLEAR_M:
            return 0
        aside = hypot(x, y)
        turn = abs(along * self._across[0] + across * self._across[1])
        # If it is higher up, nothing is next to the upper ring.
        axis_off = aside + UPPER_RING_M * tilt if lowest > UPPER_RING_M - _CLEAR_M else 0.0
        for level, leeway in enumerate(self._leeways, 1):
            if aside <= leeway.aside_m and tilt <= leeway.tilt and turn <= leeway.turn and axis_off <= leeway.play_m:
                return level
        return self._highest
