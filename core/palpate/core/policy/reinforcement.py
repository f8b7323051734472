"""Reinforcement signals: the costs of actions. All are at most 0; the goal itself brings no reward."""

from abc import abstractmethod
from dataclasses import dataclass
from math import isfinite
from typing import Annotated, ClassVar, Protocol, TypeAlias, runtime_checkable

from typing_extensions import override

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.ports import Range, Settings

_Cost: TypeAlias = Annotated[float, Range(high=0.0, text="a finite number, 0 or below")]


@dataclass(frozen=True, slots=True)
class ActionOutcome:
    """The measured effort for one action.

    Attributes:
        mean_force_N: Mean norm of the contact force.

    Raises:
        CommandError: A value is negative or not finite.
    """

    duration_s: float
    mean_force_N: float

    def __post_init__(self) -> None:
        values = (self.duration_s, self.mean_force_N)
        if not (isfinite(sum(values)) and min(values) >= 0.0):
            raise CommandError("the outcome of an action must be finite and not negative", values)


@runtime_checkable
class Reinforcement(Protocol):
    """Interface for converting an action's outcome to a reward."""

    @abstractmethod
    def __call__(self, outcome: ActionOutcome) -> float:
        """Return the reward, at most 0."""


@dataclass(frozen=True, slots=True)
class ActionPenalty(Settings, Reinforcement):
    """A constant penalty per action, which favours using the fewest actions (paper, section 5.5)."""

    TABLE: ClassVar[str] = "reinforcement"

    per_action: Annotated[float, Range(high=0.0, below=True, text="a finite number below 0")] = -1.0
    """Reward for each action."""

    def __call__(self, outcome: ActionOutcome) -> float:
        """Return the penalty, independent of the outcome."""
        return self.per_action


@dataclass(frozen=True, slots=True)
class TimePenalty(Settings, Reinforcement):
    """A penalty proportional to an action's duration, for options with variable durations."""

    TABLE: ClassVar[str] = "reinforcement"

    per_s: Annotated[float, Range(high=0.0, below=True, text="a finite number below 0")] = -10.0
    """Reward for each second."""

    def __call__(self, outcome: ActionOutcome) -> float:
        """Return the penalty for the duration."""
        return self.per_s * outcome.duration_s


@dataclass(frozen=True, slots=True)
class InternalEffort(Settings, Reinforcement):
    """An internal signal that measures the effort (paper, section 3.5).

    ``r = per_action + per_N_s * max(0, mean_force_N - free_force_N) * duration_s``: every action has a cost, and
    pushing harder than the contact requires costs more. At least one of the two rewards must not be 0.
    """

    TABLE: ClassVar[str] = "reinforcement"

    per_action: _Cost = -1.0
    """Reward for each action. If 0, actions without excess force are free, so short and long paths cost the same."""
    per_N_s: _Cost = -1.0
    """Reward for each N s of impulse above the free force."""
    free_force_N: Annotated[float, Range(0.0)] = 0.0
    """Contact force that has no cost, such as the force control set-point."""

    @override
    def check(self) -> None:
        if self.per_action == 0.0 and self.per_N_s == 0.0:
            raise ConfigurationError("reinforcement.per_N_s", self.per_N_s, "below 0 where per_action is 0")

    def __call__(self, outcome: ActionOutcome) -> float:
        """Return the cost of the action and of its impulse above the free force."""
        excess_N = max(0.0, outcome.mean_force_N - self.free_force_N)
        return self.per_action + self.per_N_s * excess_N * outcome.duration_s
