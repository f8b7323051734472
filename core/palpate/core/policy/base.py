"""Observations, decisions and transitions: the interface shared by all policies.

The task calls ``choose`` before each action and, for an action from the set, ``learn`` with its result. An
aborted trial ends with an ordinary transition: a time-out is not the goal, and treating it as one would overvalue
regions far from the hole. At the end of the trial, ``end_trial`` receives the episode outcome from port data.
"""

import enum
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, hypot, isfinite, pi, sin, sqrt
from typing import Final, Protocol, Self, runtime_checkable

import numpy as np
from typing_extensions import override

from palpate.core.errors import CommandError, ConfigurationError, LifecycleError
from palpate.core.ports import Vector3, require_names

COMPASS_NAMES: Final = ("+x", "+x+y", "+y", "-x+y", "-x", "-x-y", "-y", "+x-y")


class ControllerKind(enum.Enum):
    """Tip controller during an action in six degrees of freedom."""

    STEP = "step"
    """Slide to a position while pressing and turning to an orientation."""
    PUSH = "push"
    """Move sideways under force control, pressing at a given tilt; comply with the torque about the tool axis."""
    LIFT = "lift"
    """Move to a position and an orientation in free space."""
    WITHDRAW = "withdraw"
    """Move out of a hole with a light pull, compliant in all other directions."""
    INSERT = "insert"
    """Move down the hole until the peg is inserted or stuck."""


@dataclass(frozen=True, slots=True)
class Spatial:
    """Parameters, in addition to the step, for an action in six degrees of freedom.

    Attributes:
        controller: Controller for the action.
        rise_m: Distance to lift the tip from the plate. A push keeps the tip this far above the plate, or below it if
            negative; 0 for no bound.
        turn_rad: Tool rotation, (3,): tilt about the task's x and y axes, and yaw about its z axis.
        push_N: Push force, (2,), task frame.
        pivot_m: Pivot on the tool's end face, (2,), task frame, relative to the tip of the upright tool.
    """

    controller: ControllerKind = ControllerKind.STEP
    rise_m: float = 0.0
    turn_rad: Vector3 = (0.0, 0.0, 0.0)
    push_N: tuple[float, float] = (0.0, 0.0)
    pivot_m: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if not all(map(isfinite, self.numbers)):
            raise ConfigurationError("actions.spatial", self.numbers, "finite numbers")

    @property
    def numbers(self) -> tuple[float, ...]:
        """Return all numbers, (8,): rise, turn, push, pivot."""
        return self.rise_m, *self.turn_rad, *self.push_N, *self.pivot_m

    @classmethod
    def of(cls, controller: str, numbers: Sequence[float]) -> Self:
        """Create the parameters from a controller and the numbers that :meth:`numbers` returns."""
        rise_m, tilt_x, tilt_y, yaw, push_x, push_y, pivot_x, pivot_y = numbers
        return cls(ControllerKind(controller), rise_m, (tilt_x, tilt_y, yaw), (push_x, push_y), (pivot_x, pivot_y))


@dataclass(frozen=True, slots=True)
class Action:
    """An action that a policy can choose.

    Attributes:
        displacement_m: Tip displacement in x and y during the action, (2,), in the task frame.
        spatial: Further parameters in tasks with six degrees of freedom; None for a step in the plane.
    """

    name: str
    displacement_m: tuple[float, float]
    spatial: Spatial | None = None

    def __post_init__(self) -> None:
        if not isfinite(hypot(*self.displacement_m)):
            raise ConfigurationError("actions.displacement_m", self.displacement_m, "two finite lengths in m")


DONE: Final = Action("done", (0.0, 0.0))
"""Action that reports the peg as inserted; the task verifies the depth and ends the trial with the result."""


def compass_actions(step_m: float, directions: int = 8) -> tuple[Action, ...]:
    """Return steps of equal length in equally spaced directions, counter-clockwise from +x.

    Args:
        directions: Number of directions; eight are named like ``"+x-y"``, others by angle (``"120deg"``).

    Raises:
        ConfigurationError: The step is not positive, or there are fewer than two directions.
    """
    if not (isfinite(step_m) and step_m > 0.0):
        raise ConfigurationError("actions.step_m", step_m, "a finite length above 0 m")
    if directions < 2:
        raise ConfigurationError("actions.directions", directions, "a whole number from 2 up")
    names = COMPASS_NAMES if directions == 8 else [f"{360 * k / directions:g}deg" for k in range(directions)]
    units = (_unit_vector(k, directions) for k in range(directions))
    return tuple(Action(name, (step_m * x, step_m * y)) for name, (x, y) in zip(names, units, strict=True))


def _unit_vector(k: int, directions: int) -> tuple[float, float]:
    """Return direction ``k``, using whole quarter turns so that axes have exact zeros and opposites cancel."""
    quarters, rest = divmod(4 * k, directions)
    if 2 * rest == directions:
        x = y = sqrt(0.5)  # cos and sin of 45 degrees differ in the last bit, and between machines
    else:
        angle_rad = 0.5 * pi * rest / directions
        x, y = cos(angle_rad), sin(angle_rad)
    for _ in range(quarters):
        x, y = 0.0 - y, x  # 0.0 - y rather than -y: no negative zero
    return x, y


PROGRAMMED: Final = "programmed"
EXAMPLES: Final = "examples"
LEARNED: Final = "learned"
PERSON: Final = "person"
"""Source name for a person's decisions; a replay takes them from the log because no code can repeat them."""


@dataclass(frozen=True, slots=True)
class Observation:
    """Inputs for choosing an action; positions and wrenches are in the task frame.

    Attributes:
        turn_rad: Commanded orientation relative to the upright tool, (3,): tilt about x and y, yaw about z.
        depth_m: Tip depth below the plate, corrected for the gripper's axial spring.
        press_N: Pressing force for this trial. The torque divided by it is a lever arm, independent of the force limit.
        limit_N: Force limit for this trial.
    """

    state: int
    position_m: Vector3
    reference_m: Vector3
    force_N: Vector3
    torque_Nm: Vector3
    action_number: int
    turn_rad: Vector3 = (0.0, 0.0, 0.0)
    depth_m: float = 0.0
    press_N: float = 0.0
    limit_N: float = 0.0

    def __post_init__(self) -> None:
        _check_index("state", self.state)


@dataclass(frozen=True, slots=True)
class Decision:
    """An action and its source.

    Attributes:
        index: Index in the action set; None if it is not in the set, so that nothing learns from it.
        source: Origin of the choice: ``"programmed"``, ``"examples"``, ``"learned"``, ``"person"`` or the name of a
            baseline.
        grounds: Numbers on which the policy based the choice, such as its belief, used to compare two runs.
    """

    action: Action
    index: int | None
    source: str
    grounds: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Transition:
    """Result of an action.

    Attributes:
        reinforcement: Immediate reward, at most 0.
        next_state: State after the action; None for the goal, whose value is 0.
        next_action_index: Action that another policy will take in ``next_state``; None if the learner itself
            chooses there. Only :class:`~palpate.core.policy.programmed.MixedPolicy` sets it.
    """

    state: int
    action_index: int
    reinforcement: float
    next_state: int | None
    next_action_index: int | None = None

    def __post_init__(self) -> None:
        _check_index("state", self.state)
        _check_index("action_index", self.action_index)
        _check_index("next_state", self.next_state)
        _check_index("next_action_index", self.next_action_index)
        if not isfinite(self.reinforcement):
            raise CommandError("a reinforcement must be finite", self.reinforcement)


@dataclass(frozen=True, slots=True)
class EpisodeOutcome:
    """Episode outcome according to port data, used to label the trial's observations.

    Attributes:
        inserted: True if the peg was found to be in the hole; always False for a trial that the supervisor ended.
        tip_m: Encoder tip position, (3,), like an observation's ``position_m``; the hole position if inserted.
            Zeros if no sample was valid.
        depth_m: Tip depth below the plate's surface, at least 0.
    """

    inserted: bool
    tip_m: Vector3
    depth_m: float

    def __post_init__(self) -> None:
        if not (all(map(isfinite, self.tip_m)) and isfinite(self.depth_m) and self.depth_m >= 0.0):
            raise CommandError(
                "an episode outcome must be finite, and its depth at least 0", (self.tip_m, self.depth_m)
            )


@runtime_checkable
class Policy(Protocol):
    """Interface for policies, which choose actions and may learn."""

    @property
    def temperature(self) -> float | None:
        """Return the temperature for display, or None if the policy has none."""
        return None

    def serves(self, state: int) -> bool:
        """Return True if the policy can choose an action in the given state."""
        return True

    @abstractmethod
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """Begin a trial.

        Args:
            trial: Learning trial number, starting from 0.
        """

    @abstractmethod
    def choose(self, observation: Observation) -> Decision:
        """Choose the action to take now.

        Raises:
            ConfigurationError: The policy does not handle this state.
            LifecycleError: The policy needs random numbers, but no trial has begun.
        """

    @abstractmethod
    def learn(self, transition: Transition) -> None:
        """Learn from the result of an action; policies that do not learn ignore it."""

    def end_trial(self, episode: EpisodeOutcome) -> None:
        """Process a trial's outcome; called once, after the last ``learn``, while the arm is stationary.

        It is not called for a trial that ended with an error. Long computations belong in the next ``begin_trial``. The
        default implementation does nothing.
        """
        return


class FixedPolicy(Policy):
    """A policy that does not learn. It handles every state, and uses only its trial's random numbers."""

    def __init__(self) -> None:
        self._rng: np.random.Generator | None = None

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        self._rng = rng

    @override
    def learn(self, transition: Transition) -> None:
        return


def check_names(states: Sequence[str], actions: Sequence[Action]) -> None:
    """Reject a state space or an action set that is empty, or has duplicate or unprintable names.

    Raises:
        ConfigurationError: The message names ``policy.states`` or ``policy.actions``.
    """
    require_names("policy.states", states)
    require_names("policy.actions", [action.name for action in actions])


def drawing_from(rng: np.random.Generator | None, who: str) -> np.random.Generator:
    """Return the trial's random number generator.

    Raises:
        LifecycleError: No trial has begun.
    """
    if rng is None:
        raise LifecycleError(who, "no trial has begun", "choose()", "call begin_trial() first")
    return rng


def _check_index(name: str, index: int | None) -> None:
    if index is not None and index < 0:
        # A negative index would silently count from the end of a list.
        raise CommandError(f"{name} must not be negative", index)
