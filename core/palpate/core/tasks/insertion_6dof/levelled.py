"""A levelling touch: beside the hole the tool turns until the plate tilts it no more, then another strategy begins."""

from dataclasses import replace
from enum import Enum, auto
from math import ceil, hypot
from typing import Final

import numpy as np
from typing_extensions import override

from palpate.core.policy import Action, Decision, FixedPolicy, Law, Observation, Spatial
from palpate.core.ports import PERIOD_S
from palpate.core.trial import N_PER_KGF, TaskConfig

NAME: Final = "levelling"
_RISE_M: Final = 1.5e-3
"""So high over the plate it travels, which may lean by a degree."""
_PRESSED_SHARE: Final = 0.6
"""Of the press: the tool stands on the plate."""
_TURN_RAD_PER_NM: Final = 0.05
"""Turn of the first action over the torque, which on an edge is the same however much the tool leans. It is halved
whenever the torque turns round, for level lies between."""
_LEAST_RAD_PER_NM: Final = 0.01
"""Half of what a gripper of 50 N m/rad lets be: noise turns a small torque round, too."""
_LEVEL_NM: Final = 0.015
_LEVEL_ACTIONS: Final = 2
_LONGEST: Final = 40
"""A stage that is not over after so many actions is left all the same."""


class _LevelStage(Enum):
    RISE = auto()
    OUT = auto()
    DOWN = auto()
    LEVEL = auto()
    UP = auto()
    BACK = auto()
    ON_PLATE = auto()
    SEARCH = auto()


class Levelled(FixedPolicy):
    """Goes beside the hole along x, levels the tool there, comes back, and lets another policy search.

    The hole must not be under any of the peg there: over an edge of it a tool finds its balance where it is not level.

    Args:
        task: Its press, and how fast it travels.
        beside_m: How far it goes.
        search: What begins then; what it sees of the tool's turn is against the level tool.
    """

    def __init__(self, task: TaskConfig, beside_m: float, search: FixedPolicy) -> None:
        super().__init__()
        self._beside_m, self._search = beside_m, search
        self._pressed_N = _PRESSED_SHARE * task.press_kgf * N_PER_KGF
        self._steps = ceil(beside_m / (task.travel_speed_mm_s * 1e-3 * task.ticks_per_action * PERIOD_S))

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        super().begin_trial(trial, rng)
        self._search.begin_trial(trial, rng)
        self._stage, self._since, self._quiet = _LevelStage.RISE, 0, 0
        self._gain = _TURN_RAD_PER_NM
        self._torque_Nm: tuple[float, float]

    @override
    def choose(self, observation: Observation) -> Decision:
        """The next action of the stage, or of the search."""
        if self._over(observation):
            self._stage, self._since = _LevelStage(self._stage.value + 1), 0
            if self._stage is _LevelStage.SEARCH:
                self._began, self._level_rad = observation.action_number, observation.turn_rad
        self._since += 1
        if self._stage is _LevelStage.SEARCH:
            (x, y, yaw), (level_x, level_y, _) = observation.turn_rad, self._level_rad
            number = observation.action_number - self._began
            return self._search.choose(
                replace(observation, turn_rad=(x - level_x, y - level_y, yaw), action_number=number)
            )
        displacement_m, spatial = (0.0, 0.0), Spatial(Law.PUSH)
        if self._stage in (_LevelStage.RISE, _LevelStage.UP):
            spatial = Spatial(Law.LIFT, _RISE_M)
        elif self._stage in (_LevelStage.OUT, _LevelStage.BACK):
            way_m = self._beside_m / self._steps
            displacement_m, spatial = (way_m if self._stage is _LevelStage.OUT else -way_m, 0.0), Spatial(Law.LIFT)
        elif self._stage is _LevelStage.LEVEL:
            x, y, _ = observation.live_torque_Nm
            if self._since > 1 and x * self._torque_Nm[0] + y * self._torque_Nm[1] < 0.0:
                self._gain = max(0.5 * self._gain, _LEAST_RAD_PER_NM)
            self._torque_Nm = x, y
            spatial = Spatial(Law.PUSH, turn_rad=(self._gain * x, self._gain * y, 0.0))
        return Decision(Action(self._stage.name.lower(), displacement_m, spatial), None, NAME)

    def _over(self, observation: Observation) -> bool:
        """Whether the stage is."""
        if self._stage is _LevelStage.SEARCH or not self._since:
            return False
        if self._stage in (_LevelStage.RISE, _LevelStage.UP):
            return True
        if self._stage in (_LevelStage.OUT, _LevelStage.BACK):
            return self._since == self._steps
        if self._stage is _LevelStage.LEVEL:
            level = hypot(*observation.torque_Nm[:2]) < _LEVEL_NM
            self._quiet = self._quiet + 1 if level else 0
            return self._quiet == _LEVEL_ACTIONS or self._since == _LONGEST
        return observation.force_N[2] < -self._pressed_N or self._since == _LONGEST
