"""Actions and observations of an agent in the insertion task: the spaces of its actions and observations."""

from math import hypot, radians
from typing import Any, Final, TypeAlias

import numpy as np
from gymnasium import spaces

from palpate.adapters.config import RunConfig, task_kind
from palpate.adapters.experiments import OUTSIDE
from palpate.adapters.gymnasium_envs.episode import ActionRefusedError
from palpate.core.policy import Action, Decision, Law, Spatial
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.tasks.insertion_6dof import SpatialOptions
from palpate.core.trial import options_of, wander_m

OBSERVATION_KINDS: Final = ("symbolic", "raw", "ports")
_MARGIN_M: Final = 2e-3
"""Springs and rims: the tip may be measured so far beside the place to which it was led."""
_SEARCH_M: Final = 10e-3
"""The approach looks for the surface no deeper than this below the depth of the hole."""


_TURN_RAD_S: Final = radians(11.0)
"""Faster than this a lean asks more of a wrist near its singularity than it can do."""


def spatial_of(config: RunConfig) -> SpatialOptions | None:
    """The options of a task whose tool turns; None for any other."""
    own = task_kind(config.task.name).options is SpatialOptions
    return options_of(SpatialOptions, config.task) if own else None


class StateIndex:
    """The number of the state that the core has perceived, as its learners have it.

    In the hole nothing is perceived any more: the state is the last one before.
    """

    def __init__(self, states: int) -> None:
        self.space = spaces.Discrete(states)

    def of(self, task: InsertionTask) -> np.int64:
        """What is seen now, after a tick of the task; new data every time."""
        return np.int64(0 if task.percept is None else task.percept[1])


class TipWrench:
    """Tip and wrench, (9,), task frame: x y z in m from the nominal goal, force in N, torque about the tip in N m.

    Of a tool that turns, (12,): its commanded orientation, too: lean about x and y, yaw about z, in rad.

    It is what the core makes its symbols from: tip by the encoders, z into the hole; wrench tared, filtered, moved to
    the tip. Bounds: the exploration area and 2 mm; from above the ready height to below the hole; the force limit, and
    the torque of that force at the peg's rim; the turns that the task allows. What is beyond is cut off there.
    """

    def __init__(self, config: RunConfig) -> None:
        task = config.task
        # The start may lie beside the centre of the area, but never farther out than its corner.
        across = wander_m(config.task) + _MARGIN_M
        up, down = task.ready_height_mm * 1e-3 + _MARGIN_M, task.insertion_depth_mm * 1e-3 + _SEARCH_M
        force, torque = task.max_force_N, task.max_force_N * config.cell.peg.diameter_mm * 0.5e-3
        own = spatial_of(config)
        turns = [] if own is None else [radians(most) for most in (own.most_lean_deg,) * 2 + (own.most_yaw_deg,)]
        high = np.array([across, across, down, *[force] * 3, *[torque] * 3, *turns], np.float32)
        low = -high
        low[2] = -up
        self.space = spaces.Box(low, high, dtype=np.float32)
        self._low, self._high, self._turns = low, high, bool(turns)

    def of(self, task: InsertionTask) -> np.ndarray[Any, np.dtype[np.float32]]:
        """The nine numbers, or twelve."""
        force, torque = task.wrench_at_tip
        seen = np.array([*task.tip_m, *force, *torque, *(task.turn_rad if self._turns else ())], np.float32)
        return np.clip(seen, self._low, self._high)


WRENCH_NAMES: Final = ("force_x_N", "force_y_N", "force_z_N", "torque_x_Nm", "torque_y_Nm", "torque_z_Nm")


class PortReadings:
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


Observations: TypeAlias = StateIndex | TipWrench | PortReadings
"""An observation space, and what is seen."""
ACTION_KINDS: Final = ("discrete", "continuous")


def index_of(action: Any, count: int) -> int:
    """A discrete action as a plain number.

    Raises:
        ActionRefusedError: It is not a whole number from 0 to ``count - 1``.
    """
    # Some agents wrap the number into an array.
    number = np.asarray(action)
    if number.size != 1 or number.dtype.kind not in "iu" or not 0 <= number.item() < count:
        raise ActionRefusedError(f"action {action!r} is refused: a whole number from 0 to {count - 1}", action)
    return int(number.item())


class NumberedActions:
    """The actions that palpate's own learners choose from, in their order."""

    def __init__(self, actions: tuple[Action, ...]) -> None:
        self._actions = actions
        self.space = spaces.Discrete(len(actions))

    def decision(self, action: Any) -> Decision:
        """The action of that number."""
        index = index_of(action, len(self._actions))
        return Decision(self._actions[index], index, OUTSIDE)


class FreeSteps:
    """Steps in any direction, (2,) from -1 to 1: x and y as shares of the longest step.

    The tip moves at steady speed for the first 80 % of an action's time, so a step is a velocity too. No step is longer
    than the longest: the corners of the square are led back to the circle, in their direction.
    """

    def __init__(self, longest_m: float) -> None:
        self._longest_m = longest_m
        self.space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def decision(self, action: Any) -> Decision:
        """The step; it is none of a set, so no table learns from it."""
        x, y = _shares(action, 2)
        scale = self._longest_m / max(hypot(x, y), 1.0)
        return Decision(Action(f"({x:+.4f}, {y:+.4f})", (scale * x, scale * y)), None, OUTSIDE)


class Twists:
    """Motions of a tool that turns, (6,) from -1 to 1: x, y, z, lean about x and y, yaw, task frame.

    x, y and z are shares of the longest step, the others of what the tool turns by in an action at 11 degrees/s. With z
    below 0 the tool is lifted and moves in free space (law ``lift``); else it is pressed on (``step``), and one that
    stands upright goes in where it loses contact. Steps and turns have the longest for their length, as free steps do.
    """

    def __init__(self, longest_m: float, action_s: float) -> None:
        self._longest_m, self._longest_rad = longest_m, _TURN_RAD_S * action_s
        self.space = spaces.Box(-1.0, 1.0, (6,), np.float32)

    def decision(self, action: Any) -> Decision:
        """The motion; it is none of a set, so no table learns from it."""
        x, y, z, *turn = shares = _shares(action, 6)
        scale, turned = self._longest_m / max(hypot(x, y), 1.0), self._longest_rad / max(hypot(*turn), 1.0)
        lean_x, lean_y, yaw = (turned * share for share in turn)
        spatial = Spatial(Law.LIFT if z < 0.0 else Law.STEP, max(-z, 0.0) * self._longest_m, (lean_x, lean_y, yaw))
        name = ", ".join(f"{share:+.4f}" for share in shares)
        return Decision(Action(f"({name})", (scale * x, scale * y), spatial), None, OUTSIDE)


Actions: TypeAlias = NumberedActions | FreeSteps | Twists
"""An action space, and the core's decision that an action of it is; there is none for one that is refused."""


def _shares(action: Any, count: int) -> list[float]:
    try:
        shares = np.array(action, np.float64)
    except (TypeError, ValueError):
        shares = np.empty(0)
    if shares.shape != (count,) or not (np.abs(shares) <= 1.0).all():
        numbers = {2: "two", 6: "six"}[count]
        raise ActionRefusedError(f"action {action!r} is refused: {numbers} finite numbers from -1 to 1", action)
    found: list[float] = shares.tolist()
    return found
