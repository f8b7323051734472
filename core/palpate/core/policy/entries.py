"""Parts of a JSON policy file (actions and learners), and rows in the printed table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import degrees, isclose
from typing import Annotated, Any, ClassVar, Final, Self

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Action, ControllerKind, Spatial
from palpate.core.policy.belief import BeliefLearner, BeliefParameters, ContactModel
from palpate.core.policy.hmm import HmmLearner, HmmParameters
from palpate.core.policy.learner import ANY_BOUNDS, TaskBounds
from palpate.core.policy.sarsa import OptionParameters, Sarsa, SarsaParameters
from palpate.core.policy.tabular import QLearning, QParameters, TabularLearner
from palpate.core.ports import OneOf, Settings, fitted, kinds_of, require_keys

LEARNERS: Final[dict[str, type[Settings]]] = {
    "q-learning": QParameters,
    "sarsa": SarsaParameters,
    "options": OptionParameters,
    "belief": BeliefParameters,
    "hmm": HmmParameters,
}
"""Settings for each kind of learner in files."""
_LEARNED: Final = ("q", "visits", "trials", "trials_learned")
"""Entries in a learner's state that persist between trials."""
OwnLearner = TabularLearner | BeliefLearner | HmmLearner


def tabular_learner(
    parameters: QParameters, states: Sequence[str], actions: Sequence[Action], *, frozen: bool = False
) -> TabularLearner:
    """Create a tabular learner from its settings: Sarsa(lambda) or Q-learning."""
    if isinstance(parameters, SarsaParameters):
        return Sarsa(states, actions, parameters, frozen=frozen)
    return QLearning(states, actions, parameters, frozen=frozen)


def new_learner(
    parameters: Settings,
    states: Sequence[str],
    actions: Sequence[Action],
    bounds: TaskBounds = ANY_BOUNDS,
    *,
    frozen: bool = False,
) -> OwnLearner:
    """Create a learner from its settings.

    Args:
        bounds: Task bounds for a belief learner.

    Raises:
        ConfigurationError: A value is out of range, a name is repeated, or the learner is not suitable for the task.
    """
    if isinstance(parameters, BeliefParameters):
        return BeliefLearner(parameters, bounds, frozen=frozen)
    if isinstance(parameters, HmmParameters):
        return HmmLearner(states, actions, parameters, frozen=frozen)
    if isinstance(parameters, QParameters):
        return tabular_learner(parameters, states, actions, frozen=frozen)
    raise ConfigurationError("learner", type(parameters).__name__, f"settings of one of {', '.join(LEARNERS)}")


@dataclass(frozen=True, slots=True)
class SpatialEntry(Settings):
    """Parameters, in addition to the step, for an action in six degrees of freedom."""

    controller: Annotated[str, OneOf(*(controller.value for controller in ControllerKind))]
    """Controller for the action."""
    rise_mm: float
    """Tip lift."""
    turn_deg: tuple[float, float, float]
    """Tool rotation: tilt about x and y, and yaw."""
    push_N: tuple[float, float]
    """Push force."""
    pivot_mm: tuple[float, float]
    """Pivot on the end face."""

    @classmethod
    def of(cls, spatial: Spatial) -> Self:
        """Convert parameters to the file's format."""
        x, y, yaw = map(degrees, spatial.turn_rad)
        return cls(
            spatial.controller.value, 1e3 * spatial.rise_m, (x, y, yaw), spatial.push_N, _scaled(spatial.pivot_m, 1e3)
        )


@dataclass(frozen=True, slots=True)
class ActionEntry(Settings):
    """One action in the file."""

    name: str
    """Action name."""
    displacement_mm: tuple[float, float]
    """Tip displacement in x and y, (2,), in the task frame."""
    spatial: SpatialEntry | None = None
    """Parameters in six degrees of freedom; None for a step in the plane."""

    @classmethod
    def of(cls, action: Action) -> Self:
        """Convert an action to the file's format."""
        spatial = None if action.spatial is None else SpatialEntry.of(action.spatial)
        return cls(action.name, _scaled(action.displacement_m, 1e3), spatial)

    def step(self) -> Action:
        """Return the step in the plane; conversion from mm may change the least significant bit."""
        return Action(self.name, _scaled(self.displacement_mm, 1e-3))

    def require_same(self, where: str, other: Self) -> None:
        """Reject an action that differs from the task's by more than a rounding error.

        Raises:
            ConfigurationError: The message names the first field that differs, after ``where``.
        """
        _require_same(where, asdict(self), asdict(other))


def _scaled(pair: tuple[float, float], factor: float) -> tuple[float, float]:
    return factor * pair[0], factor * pair[1]


def _require_same(where: str, mine: Any, wanted: Any) -> None:
    if isinstance(mine, dict) and isinstance(wanted, dict):
        for name, value in mine.items():
            _require_same(f"{where}.{name}", value, wanted[name])
    elif not _same(mine, wanted):
        raise ConfigurationError(where, mine, f"{wanted!r}, as in this task")


def _same(mine: Any, wanted: Any) -> bool:
    if isinstance(mine, tuple) and isinstance(wanted, tuple):
        return all(map(_same, mine, wanted))
    if isinstance(mine, float) and isinstance(wanted, float):
        # Far below the resolution of any arm in mm, degrees and N, but far above rounding errors.
        return isclose(mine, wanted, rel_tol=0.0, abs_tol=1e-6)
    return bool(mine == wanted)


@dataclass(frozen=True, slots=True)
class LearnerEntry(Settings):
    """A learner's settings and learned state."""

    TABLE: ClassVar[str] = "learner"

    kind: Annotated[str, OneOf(*LEARNERS)]
    """Learner name."""
    parameters: Settings
    """Learner settings."""
    state: Mapping[str, Any]
    """Learned state: the part of ``get_state`` that persists between trials."""

    @classmethod
    def of(cls, learner: OwnLearner) -> Self:
        """Convert a learner to the file's format."""
        kind = next(kind for kind, settings in LEARNERS.items() if type(learner.parameters) is settings)
        state = {key: value for key, value in learner.get_state().items() if key in _LEARNED}
        return cls(kind, learner.parameters, state)

    @property
    def trials_learned(self) -> int:
        """Return the number of trials from which the learner has learned."""
        return int(self.state["trials_learned"])

    @property
    def contact_model(self) -> ContactModel | None:
        """Return a belief learner's contact model, or None for other learners or if there are too few trials."""
        learner = self.learner((), ()) if self.kind == "belief" else None
        return learner.model if isinstance(learner, BeliefLearner) else None

    def learner(
        self, states: Sequence[str], actions: Sequence[Action], bounds: TaskBounds = ANY_BOUNDS, *, frozen: bool = True
    ) -> OwnLearner:
        """Create the learner with its stored state for a task.

        Raises:
            ConfigurationError: The state belongs to a different task, or is invalid.
        """
        learner = new_learner(self.parameters, states, actions, bounds, frozen=frozen)
        begun = learner.get_state()
        require_keys("learner.state", self.state, [key for key in begun if key in _LEARNED])
        learner.set_state(begun | dict(self.state))
        return learner

    @classmethod
    @override
    def read(cls, raw: object, where: str = "learner") -> Self:
        given = fitted(where, raw, Mapping[str, Any])
        require_keys(where, given, tuple(kinds_of(cls)))
        kind: str = fitted(f"{where}.kind", given["kind"], kinds_of(cls)["kind"])
        parameters = LEARNERS[kind].read(given["parameters"], f"{where}.parameters")
        return cls(kind, parameters, fitted(f"{where}.state", given["state"], Mapping[str, Any]))


@dataclass(frozen=True, slots=True)
class TableRow:
    """The action for a state, with its origin.

    Attributes:
        source: Origin of the action: programmed, examples or learned.
        action: Name of the assigned action or the best learned one.
        q: Q value for each action, (n actions,); None if there is no Q table.
        visits_per_action: Number of updates for each action; None if there is no Q table.
        best: Index of ``action``.
    """

    state: str
    source: str
    action: str
    best: int
    q: tuple[float, ...] | None
    visits_per_action: tuple[int, ...] | None

    @property
    def value(self) -> float | None:
        """Return the action's Q value, or None if there is no Q table."""
        return None if self.q is None else self.q[self.best]

    @property
    def visits(self) -> int:
        """Return the number of updates in the state."""
        return sum(self.visits_per_action or ())
