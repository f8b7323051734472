"""Observations, decisions and transitions: the interface that every policy has.

The task calls ``choose`` before each action and, when the action was one of the set, ``learn`` with
what came of it. A trial that is aborted ends with an ordinary transition: running out of time is not
the goal, and calling it one would make lost regions look good. When all is over, ``end_trial`` has what
the port data came to.
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
from palpate.core.ports import Vector3

COMPASS_NAMES: Final = ("+x", "+x+y", "+y", "-x+y", "-x", "-x-y", "-y", "+x-y")


class Law(enum.Enum):
    """The control law of an action in six degrees of freedom: how each direction of the tip is led."""

    STEP = "step"
    """Across to a place, pressing, turning to an orientation."""
    PUSH = "push"
    """Across by force, pressing, leaning as asked; the tool gives way to the torque about its axis."""
    LIFT = "lift"
    """To a place and an orientation in free space."""
    WITHDRAW = "withdraw"
    """Back out of a hole by a light pull, giving way to all else."""
    INSERT = "insert"
    """Down the hole, until the peg is in or stuck."""


@dataclass(frozen=True, slots=True)
class Spatial:
    """What an action in six degrees of freedom does beside its step across.

    Attributes:
        law: Its control law.
        rise_m: By how much it lifts the tip, away from the plate. A push keeps the tip so far above it, or below where
            this is negative; 0 for no such bound.
        turn_rad: By how much it turns the tool, (3,): lean about the task's x and y, and yaw about its z.
        push_N: Force with which it pushes, (2,), task frame.
        pivot_m: Point of the tool's end face about which it turns, (2,), task frame, from the tip of the upright tool.
    """

    law: Law = Law.STEP
    rise_m: float = 0.0
    turn_rad: Vector3 = (0.0, 0.0, 0.0)
    push_N: tuple[float, float] = (0.0, 0.0)
    pivot_m: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if not all(map(isfinite, self.numbers)):
            raise ConfigurationError("actions.spatial", self.numbers, "finite numbers")

    @property
    def numbers(self) -> tuple[float, ...]:
        """All of it but the law, (8,): rise, turn, push, pivot."""
        return self.rise_m, *self.turn_rad, *self.push_N, *self.pivot_m

    @classmethod
    def of(cls, law: str, numbers: Sequence[float]) -> Self:
        """The one with these numbers."""
        rise_m, lean_x, lean_y, yaw, push_x, push_y, pivot_x, pivot_y = numbers
        return cls(Law(law), rise_m, (lean_x, lean_y, yaw), (push_x, push_y), (pivot_x, pivot_y))


@dataclass(frozen=True, slots=True)
class Action:
    """One action of a policy.

    Attributes:
        displacement_m: XY displacement of the tip during the action, (2,), in the task frame.
        spatial: What else it does, in tasks of six degrees of freedom; None for a step as it always was.
    """

    name: str
    displacement_m: tuple[float, float]
    spatial: Spatial | None = None

    def __post_init__(self) -> None:
        if not isfinite(hypot(*self.displacement_m)):
            raise ConfigurationError("actions.displacement_m", self.displacement_m, "two finite lengths in m")


def compass_actions(step_m: float, directions: int = 8) -> tuple[Action, ...]:
    """Steps of equal length in equally spaced directions, from +x counter-clockwise.

    Args:
        directions: How many; eight are named like ``"+x-y"``, other numbers by angle (``"120deg"``).

    Raises:
        ConfigurationError: The step is not positive or there are fewer than two directions.
    """
    if not (isfinite(step_m) and step_m > 0.0):
        raise ConfigurationError("actions.step_m", step_m, "a finite length above 0 m")
    if directions < 2:
        raise ConfigurationError("actions.directions", directions, "a whole number from 2 up")
    names = COMPASS_NAMES if directions == 8 else [f"{360 * k / directions:g}deg" for k in range(directions)]
    units = (_unit_vector(k, directions) for k in range(directions))
    return tuple(Action(name, (step_m * x, step_m * y)) for name, (x, y) in zip(names, units, strict=True))


def _unit_vector(k: int, directions: int) -> tuple[float, float]:
    """Direction ``k``: turned by whole quarters, so that axes have true zeros and opposites cancel."""
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
"""Source of decisions that a replay takes from the log, because no code could make them again."""


@dataclass(frozen=True, slots=True)
class Observation:
    """What is known when an action is to be chosen; lengths and wrenches in the task frame.

    Attributes:
        turn_rad: Commanded orientation against the upright tool, (3,): lean about x and y, yaw about z.
        live_torque_Nm: Torque about the tip, not filtered.
        depth_m: Depth of the tip below the plate, corrected for the gripper's axial spring.
    """

    state: int
    position_m: Vector3
    reference_m: Vector3
    force_N: Vector3
    torque_Nm: Vector3
    action_number: int
    turn_rad: Vector3 = (0.0, 0.0, 0.0)
    live_torque_Nm: Vector3 = (0.0, 0.0, 0.0)
    depth_m: float = 0.0

    def __post_init__(self) -> None:
        _check_index("state", self.state)


@dataclass(frozen=True, slots=True)
class Decision:
    """An action and where it came from.

    Attributes:
        index: Its place in the action set; None when it is not of the set, so nothing learns from it.
        source: Which knowledge chose it: ``"programmed"``, ``"examples"``, ``"learned"``, ``"person"`` or the name
            of a baseline.
        grounds: Numbers that a policy chose it by, such as what it believes; for whoever compares two runs.
    """

    action: Action
    index: int | None
    source: str
    grounds: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Transition:
    """What came of one action.

    Attributes:
        reinforcement: The immediate reward, at most 0 here.
        next_state: State afterwards; None when the goal was reached, whose value is 0.
        next_action_index: The action that another policy is bound to take in ``next_state``; None when
            the learner chooses there itself. Only :class:`~palpate.core.policy.programmed.MixedPolicy` sets it.
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
class Hindsight:
    """What the port data came to when a trial was over: what its observations were of.

    Attributes:
        inserted: Whether the peg was found to be in the hole; never of a trial that the supervisor ended.
        tip_m: Tip by the encoders, (3,), as ``position_m`` of an observation: when inserted it is where the hole is.
            Zeros where not one sample was sound.
        depth_m: Depth of the tip below the plate's surface, at least 0.
    """

    inserted: bool
    tip_m: Vector3
    depth_m: float

    def __post_init__(self) -> None:
        if not (all(map(isfinite, self.tip_m)) and isfinite(self.depth_m) and self.depth_m >= 0.0):
            raise CommandError("hindsight must be finite, and a depth at least 0", (self.tip_m, self.depth_m))


@runtime_checkable
class Policy(Protocol):
    """Chooses actions; may learn."""

    @property
    @abstractmethod
    def temperature(self) -> float | None:
        """Degree of randomness, for display; None where there is no such thing."""

    @abstractmethod
    def serves(self, state: int) -> bool:
        """Whether it can choose in this state."""

    @abstractmethod
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """Begin a trial.

        Args:
            trial: Number of the trial in the course of learning, from 0.
        """

    def foresee(self, place_m: tuple[float, float]) -> None:
        """Make ready, a tick ahead, for a choice with the commanded tip at this place, (x, y), task frame.

        The choice may be made elsewhere, or never, and has to be the same as if this had not been called. A policy
        that derives from this class and does not override it ignores it.
        """
        return

    @abstractmethod
    def choose(self, observation: Observation) -> Decision:
        """The action to take now.

        Raises:
            ConfigurationError: It does not serve this state.
            LifecycleError: It needs random numbers and no trial has begun.
        """

    @abstractmethod
    def learn(self, transition: Transition) -> None:
        """Learn from what came of an action; a policy that does not learn ignores it."""

    def end_trial(self, hindsight: Hindsight) -> None:
        """Take note of what a trial came to, once, after its last ``learn`` and with the arm at rest.

        A trial that an error ended has none. What takes long belongs into the next ``begin_trial``. A policy that
        derives from this class and does not override it ignores it.
        """
        return


class FixedPolicy(Policy):
    """A policy that learns nothing; it serves every state, and draws from the generator of its trial, if at all."""

    def __init__(self) -> None:
        self._rng: np.random.Generator | None = None

    @property
    @override
    def temperature(self) -> float | None:
        return None

    @override
    def serves(self, state: int) -> bool:
        return True

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        self._rng = rng

    @override
    def learn(self, transition: Transition) -> None:
        return


def check_names(states: Sequence[str], actions: Sequence[Action]) -> None:
    """Refuse a state space or an action set that is empty, has a name twice or one that cannot be shown.

    Raises:
        ConfigurationError: Naming ``policy.states`` or ``policy.actions``.
    """
    for field, names in (("states", states), ("actions", [action.name for action in actions])):
        shown = all(name and name.isprintable() for name in names)
        if not names or len(set(names)) != len(names) or not shown:
            raise ConfigurationError(f"policy.{field}", tuple(names), "at least one printable name, and none twice")


def drawing_from(rng: np.random.Generator | None, who: str) -> np.random.Generator:
    """The generator of the trial.

    Raises:
        LifecycleError: No trial has begun.
    """
    if rng is None:
        raise LifecycleError(who, "no trial has begun", "choose()", "call begin_trial() first")
    return rng


def _check_index(name: str, index: int | None) -> None:
    if index is not None and index < 0:
        # A negative index would quietly count from the end of a list.
        raise CommandError(f"{name} must not be negative", index)
