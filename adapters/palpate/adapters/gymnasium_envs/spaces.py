"""Action and observation spaces for an agent in the insertion task."""

from math import hypot, radians
from typing import Any, Final, TypeAlias

import numpy as np
from gymnasium import spaces

from palpate.adapters.config import RunConfig, task_kind
from palpate.adapters.experiments import OUTSIDE
from palpate.adapters.gymnasium_envs.episode import ActionRefusedError
from palpate.core.policy import Action, ControllerKind, Decision, Spatial
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.tasks.insertion_6dof import SpatialOptions
from palpate.core.trial import options_of, wander_m

OBSERVATION_KINDS: Final = ("symbolic", "raw", "ports")
_MARGIN_M: Final = 2e-3
"""Maximum deviation of the measured tip from its commanded position, caused by springs and rims."""
_SEARCH_M: Final = 10e-3
"""Depth beyond the insertion depth to which the approach searches for the surface."""


_TURN_RAD_S: Final = radians(11.0)
"""Turning speed. Faster tilting would exceed a wrist's joint speed limits near its singularity."""


def spatial_of(config: RunConfig) -> SpatialOptions | None:
    """Return the options for a task that turns the tool, or None for any other task."""
    own = task_kind(config.task.name).options is SpatialOptions
    return options_of(SpatialOptions, config.task) if own else None


class StateIndex:
    """Index of the perceived state, as for palpate's own learners; in the hole, the last index before entry."""

    def __init__(self, states: int) -> None:
        self.space = spaces.Discrete(states)

    def of(self, task: InsertionTask) -> np.int64:
        """Return a new observation after a tick of the task."""
        return np.int64(0 if task.percept is None else task.percept[1])


class TipWrench:
    """Tip and wrench, (9,), task frame: x y z in m from the nominal goal, force in N, torque about the tip in N m.

    For a tool that turns, (12,): also its commanded orientation (tilt about x and y, yaw about z) in rad.

    The core derives its symbols from the same values: tip position from the encoders, z into the hole; the wrench
    tared, filtered and moved to the tip. Values are clipped to the bounds: the exploration area plus 2 mm; from above
    the ready height to below the hole; the force limit, and the torque of that force at the peg's rim; the turns that
    the task allows.
    """

    def __init__(self, config: RunConfig) -> None:
        task = config.task
        # The start may be off-centre in the area, but never farther out than its corner.
        across = wander_m(config.task) + _MARGIN_M
        up, down = task.ready_height_mm * 1e-3 + _MARGIN_M, task.insertion_depth_mm * 1e-3 + _SEARCH_M
        force, torque = task.max_force_N, task.max_force_N * config.cell.peg.diameter_mm * 0.5e-3
        own = spatial_of(config)
        turns = [] if own is None else [radians(most) for most in (own.most_tilt_deg,) * 2 + (own.most_yaw_deg,)]
        high = np.array([across, across, down, *[force] * 3, *[torque] * 3, *turns], np.float32)
        low = -high
        low[2] = -up
        self.space = spaces.Box(low, high, dtype=np.float32)
        self._low, self._high, self._turns = low, high, bool(turns)

    def of(self, task: InsertionTask) -> np.ndarray[Any, np.dtype[np.float32]]:
        """Return the nine or twelve values."""
        force, torque = task.wrench_at_tip
        seen = np.array([*task.tip_m, *force, *torque, *(task.turn_rad if self._turns else ())], np.float32)
        return np.clip(seen, self._low, self._high)


WRENCH_NAMES: Final = ("force_x_N", "force_y_N", "force_z_N", "torque_x_Nm", "torque_y_Nm", "torque_z_Nm")


class PortReadings:
    """Unfiltered port data from the latest tick for recording, float64, in the order of ``names``.

    They are the joint angles and wrench as measured (untared, sensor frame), run-clock times of the tick and of both
    measurements, and the command applied in the previous tick, all unbounded.
    """

    def __init__(self, joints: int) -> None:
        numbers = range(1, joints + 1)
        times = "time_s", "wrench_source_time_s", "joints_source_time_s"
        angles = (tuple(f"{what}_{number}_rad" for number in numbers) for what in ("joint", "applied"))
        measured, applied = angles
        self.names = (*measured, *WRENCH_NAMES, *times, *applied)
        self.space = spaces.Box(-np.inf, np.inf, (len(self.names),), np.float64)

    def of(self, task: InsertionTask) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return the port data as numbers."""
        now = task.snapshot
        wrench, joints = now.wrench, now.joints
        applied = joints if now.applied is None else now.applied
        times_s = (1e-9 * time_ns for time_ns in (now.time_ns, wrench.source_time_ns, joints.source_time_ns))
        return np.array(
            [*joints.position_rad, *wrench.force_N, *wrench.torque_Nm, *times_s, *applied.position_rad], np.float64
        )


Observations: TypeAlias = StateIndex | TipWrench | PortReadings
"""An observation space and its observation type."""
ACTION_KINDS: Final = ("discrete", "continuous")


class NumberedActions:
    """The numbered actions from which palpate's own learners choose."""

    def __init__(self, actions: tuple[Action, ...]) -> None:
        self._actions = actions
        self.space = spaces.Discrete(len(actions))

    def decision(self, action: Any) -> Decision:
        """Return the action with this number.

        Raises:
            ActionRefusedError: The action is not a whole number from 0 to one less than the number of actions.
        """
        # Some agents wrap the number into an array.
        number, count = np.asarray(action), len(self._actions)
        if number.size != 1 or number.dtype.kind not in "iu" or not 0 <= number.item() < count:
            raise ActionRefusedError(f"action must be a whole number from 0 to {count - 1} (got {action!r})", action)
        return Decision(self._actions[number.item()], int(number.item()), OUTSIDE)


class FreeSteps:
    """Steps in any direction, (2,) from -1 to 1: x and y as fractions of the maximum step.

    The tip moves at constant speed during the first 80 % of an action, so a step also sets a velocity. Longer steps, in
    the corners of the square, are shortened to the maximum step in the same direction.
    """

    def __init__(self, longest_m: float) -> None:
        self._longest_m = longest_m
        self.space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def decision(self, action: Any) -> Decision:
        """Return the step, which is in no action set, so tabular learners do not learn from it."""
        x, y = _shares(action, 2)
        scale = self._longest_m / max(hypot(x, y), 1.0)
        return Decision(Action(f"({x:+.4f}, {y:+.4f})", (scale * x, scale * y)), None, OUTSIDE)


class Twists:
    """Motions of a tool that turns, (6,) from -1 to 1: x, y, z, tilt about x and y, and yaw, task frame.

    x, y and z are fractions of the maximum step, and the others of the turn per action at 11 degrees/s. With z below 0,
    the tool is lifted and moves in free space (controller ``lift``); otherwise it keeps pressing (``step``), and an
    upright tool enters the hole where it loses contact. The lengths of steps and turns are limited as for free steps.
    """

    def __init__(self, longest_m: float, action_s: float) -> None:
        self._longest_m, self._longest_rad = longest_m, _TURN_RAD_S * action_s
        self.space = spaces.Box(-1.0, 1.0, (6,), np.float32)

    def decision(self, action: Any) -> Decision:
        """Return the motion, which is in no action set, so tabular learners do not learn from it."""
        x, y, z, *turn = shares = _shares(action, 6)
        scale, turned = self._longest_m / max(hypot(x, y), 1.0), self._longest_rad / max(hypot(*turn), 1.0)
        tilt_x, tilt_y, yaw = (turned * share for share in turn)
        spatial = Spatial(
            ControllerKind.LIFT if z < 0.0 else ControllerKind.STEP,
            max(-z, 0.0) * self._longest_m,
            (tilt_x, tilt_y, yaw),
        )
        name = ", ".join(f"{share:+.4f}" for share in shares)
        return Decision(Action(f"({name})", (scale * x, scale * y), spatial), None, OUTSIDE)


Actions: TypeAlias = NumberedActions | FreeSteps | Twists
"""An action space, and the conversion of its actions to decisions of the core; invalid actions are rejected."""


def _shares(action: Any, count: int) -> list[float]:
    try:
        shares = np.array(action, np.float64)
    except (TypeError, ValueError):
        shares = np.empty(0)
    if shares.shape != (count,) or not (np.abs(shares) <= 1.0).all():
        numbers = {2: "two", 6: "six"}[count]
        raise ActionRefusedError(f"action must be {numbers} finite numbers from -1 to 1 (got {action!r})", action)
    found: list[float] = shares.tolist()
    return found
