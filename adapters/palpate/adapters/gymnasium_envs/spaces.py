"""Actions and observations of an agent in the insertion task: the spaces of its actions and observations."""

from __future__ import annotations

from abc import abstractmethod
from math import hypot, isfinite
from typing import Any, Final, Protocol

import numpy as np
from gymnasium import spaces

from palpate.adapters.config import RunConfig
from palpate.adapters.gymnasium_envs.episode import SOURCE, ActionRefusedError
from palpate.core.policy import Action, Decision
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.trial import wander_m

OBSERVATION_KINDS: Final = ("symbolic", "raw", "ports")
_MARGIN_M: Final = 2e-3
"""Springs and rims: the tip may be measured so far beside the place to which it was led."""
_SEARCH_M: Final = 10e-3
"""The approach looks for the surface no deeper than this below the depth of the hole."""


class Observations(Protocol):
    """An observation space, and what is seen after a tick of the task."""

    space: spaces.Space[Any]

    @abstractmethod
    def of(self, task: InsertionTask) -> Any:
        """What is seen now; new data every time."""


class StateIndex(Observations):
    """The number of the state that the core has perceived, as its learners have it.

    In the hole nothing is perceived any more: the state is the last one before.
    """

    def __init__(self, states: int) -> None:
        self.space = spaces.Discrete(states)

    def of(self, task: InsertionTask) -> np.int64:
        """The state."""
        return np.int64(0 if task.percept is None else task.percept[1])


class TipWrench(Observations):
    """Tip and wrench, (9,), task frame: x y z in m from the nominal goal, force in N, torque about the tip in N m.

    It is what the core makes its symbols from: tip by the encoders, z into the hole; wrench tared, filtered, moved to
    the tip. Bounds: the exploration area and 2 mm; from above the ready height to below the hole; the force limit, and
    the torque of that force at the peg's rim. What is beyond is cut off there.
    """

    def __init__(self, config: RunConfig) -> None:
        task = config.task
        # The start may lie beside the centre of the area, but never farther out than its corner.
        across = wander_m(config.task) + _MARGIN_M
        up, down = task.ready_height_mm * 1e-3 + _MARGIN_M, task.insertion_depth_mm * 1e-3 + _SEARCH_M
        force, torque = task.max_force_N, task.max_force_N * config.cell.peg.diameter_mm * 0.5e-3
        high = np.array([across, across, down, *[force] * 3, *[torque] * 3], np.float32)
        low = -high
        low[2] = -up
        self.space = spaces.Box(low, high, dtype=np.float32)
        self._low, self._high = low, high

    def of(self, task: InsertionTask) -> np.ndarray[Any, np.dtype[np.float32]]:
        """The nine numbers."""
        force, torque = task.wrench_at_tip
        seen = np.array([*task.tip_m, *force, *torque], np.float32)
        return np.clip(seen, self._low, self._high)


WRENCH_NAMES: Final = ("force_x_N", "force_y_N", "force_z_N", "torque_x_Nm", "torque_y_Nm", "torque_z_Nm")


class PortReadings(Observations):
    """What the ports gave in the newest tick, unfiltered, float64, in the order of ``names``; for recording.

    Joint angles and wrench as measured (wrench untared, sensor frame), run-clock times of the tick and of both
    measurements, and the command of the tick before as it was applied. Unbounded.

    Attributes:
        names: What each number is, with its unit.
    """

    def __init__(self, joints: int) -> None:
        numbers = range(1, joints + 1)
        times = "time_s", "wrench_source_time_s", "joints_source_time_s"
        angles = (tuple(f"{what}_{number}_rad" for number in numbers) for what in ("joint", "applied"))
        measured, applied = angles
        self.names = (*measured, *WRENCH_NAMES, *times, *applied)
        self.space = spaces.Box(-np.inf, np.inf, (len(self.names),), np.float64)

    def of(self, task: InsertionTask) -> np.ndarray[Any, np.dtype[np.float64]]:
        """The numbers."""
        now = task.snapshot
        wrench, joints = now.wrench, now.joints
        applied = joints if now.applied is None else now.applied
        times_s = (1e-9 * time_ns for time_ns in (now.time_ns, wrench.source_time_ns, joints.source_time_ns))
        return np.array(
            [*joints.position_rad, *wrench.force_N, *wrench.torque_Nm, *times_s, *applied.position_rad], np.float64
        )


ACTION_KINDS: Final = ("discrete", "continuous")


class Actions(Protocol):
    """An action space, and what its actions mean to the core."""

    space: spaces.Space[Any]

    @abstractmethod
    def decision(self, action: Any) -> Decision:
        """The core's decision.

        Raises:
            ActionRefusedError: There is no such action.
        """


def index_of(action: Any, count: int) -> int:
    """A discrete action as a plain number.

    Raises:
        ActionRefusedError: It is not a whole number from 0 to ``count - 1``.
    """
    # Some agents wrap the number into an array.
    number = action.item() if isinstance(action, np.ndarray) and action.size == 1 else action
    if not isinstance(number, (int, np.integer)) or isinstance(number, bool) or not 0 <= number < count:
        raise ActionRefusedError(f"action {action!r} is refused: a whole number from 0 to {count - 1}", action)
    return int(number)


class CompassSteps(Actions):
    """The steps that palpate's own learners choose from, in their order."""

    def __init__(self, steps: tuple[Action, ...]) -> None:
        self._steps = steps
        self.space = spaces.Discrete(len(steps))

    def decision(self, action: Any) -> Decision:
        """The compass step of that number."""
        index = index_of(action, len(self._steps))
        return Decision(self._steps[index], index, SOURCE)


class FreeSteps(Actions):
    """Steps in any direction, (2,) from -1 to 1: x and y as shares of the longest step.

    The tip moves at steady speed for the first 80 % of an action's time, so a step is a velocity too. No step is longer
    than the longest: the corners of the square are led back to the circle, in their direction.
    """

    def __init__(self, longest_m: float) -> None:
        self._longest_m = longest_m
        self.space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def decision(self, action: Any) -> Decision:
        """The step; it is none of a set, so no table learns from it."""
        try:
            x, y = (float(share) for share in action)
        except (TypeError, ValueError):
            raise _refused(action) from None
        if not (isfinite(x) and isfinite(y) and max(abs(x), abs(y)) <= 1.0):
            raise _refused(action)
        scale = self._longest_m / max(hypot(x, y), 1.0)
        return Decision(Action(f"({x:+.4f}, {y:+.4f})", (scale * x, scale * y)), None, SOURCE)


def _refused(action: Any) -> ActionRefusedError:
    return ActionRefusedError(f"action {action!r} is refused: two finite numbers from -1 to 1", action)
