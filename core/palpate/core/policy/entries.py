"""The parts of a policy file - action, row of the table, learner - as JSON has them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import degrees, isclose
from typing import Annotated, Any, ClassVar, Final, Self

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import EXAMPLES, LEARNED, PROGRAMMED, Action, Law, Spatial
from palpate.core.policy.sarsa import SarsaParameters, SkillParameters
from palpate.core.policy.tabular import QParameters
from palpate.core.ports import OneOf, Range, Settings, fitted, kinds_of, require_keys

LEARNERS: Final[dict[str, type[QParameters]]] = {
    "q-learning": QParameters,
    "sarsa": SarsaParameters,
    "skills": SkillParameters,
}
"""Kinds of learners in files, and the settings that each has."""


@dataclass(frozen=True, slots=True)
class SpatialEntry(Settings):
    """What an action in six degrees of freedom does in addition to its step across."""

    law: Annotated[str, OneOf(*(law.value for law in Law))]
    """Its controller."""
    rise_mm: float
    """By how much it lifts the tip."""
    turn_deg: tuple[float, float, float]
    """By how much it turns the tool: tilt about x and y, and yaw."""
    push_N: tuple[float, float]
    """Force with which it pushes."""
    pivot_mm: tuple[float, float]
    """Point of the end face about which it turns."""

    @classmethod
    def of(cls, spatial: Spatial) -> Self:
        """The live one as the file has it."""
        x, y, yaw = map(degrees, spatial.turn_rad)
        return cls(spatial.law.value, 1e3 * spatial.rise_m, (x, y, yaw), spatial.push_N, _scaled(spatial.pivot_m, 1e3))


@dataclass(frozen=True, slots=True)
class ActionEntry(Settings):
    """One action of the file."""

    name: str
    """Its name."""
    displacement_mm: tuple[float, float]
    """XY displacement of the tip, (2,), in the task frame."""
    spatial: SpatialEntry | None = None
    """What it does in six degrees of freedom; None for a step across."""

    @classmethod
    def of(cls, action: Action) -> Self:
        """A live action as the file has it."""
        spatial = None if action.spatial is None else SpatialEntry.of(action.spatial)
        return cls(action.name, _scaled(action.displacement_m, 1e3), spatial)

    def step(self) -> Action:
        """The step across, live; rounded to mm, which may cost the last bit."""
        return Action(self.name, _scaled(self.displacement_mm, 1e-3))

    def require_same(self, where: str, other: Self) -> None:
        """Refuse an action that is not the task's, however the numbers were rounded.

        Raises:
            ConfigurationError: Naming the first field that differs, behind ``where``.
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
        # Far below any arm's resolution in mm, degrees and N, far above the rounding on the way to them.
        return isclose(mine, wanted, rel_tol=0.0, abs_tol=1e-6)
    return bool(mine == wanted)


@dataclass(frozen=True, slots=True)
class TableRow(Settings):
    """What is known for one state."""

    TABLE: ClassVar[str] = "table"

    state: str
    """Its name."""
    source: Annotated[str, OneOf(PROGRAMMED, EXAMPLES, LEARNED)]
    """Which knowledge the action is from."""
    action: str
    """Name of the assigned action, or of the best one that was learned."""
    value: float | None
    """Q of that action; None without a learner."""
    visits: Annotated[int, Range(0)]
    """How often the learner learned from this state."""
    q: tuple[float, ...] | None
    """Q of each action, (n actions,); None without a learner."""
    visits_per_action: tuple[Annotated[int, Range(0)], ...] | None
    """How often each action was learned from; None without a learner."""

    @classmethod
    def of(
        cls,
        state: str,
        source: str,
        action: str,
        best: int,
        q: tuple[float, ...] | None = None,
        visits_per_action: tuple[int, ...] | None = None,
    ) -> Self:
        """A row whose value and visits follow from what was learned; ``best`` is the index of its action."""
        value = None if q is None else q[best]
        return cls(state, source, action, value, sum(visits_per_action or ()), q, visits_per_action)

    @property
    def best(self) -> int | None:
        """Index of the first action of this value; None without a learner."""
        return None if self.q is None or self.value is None else self.q.index(self.value)

    def require_consistent(self, where: str, actions: Sequence[str], has_learner: bool) -> None:
        """Refuse a row that is not over these actions, or contradicts itself.

        Raises:
            ConfigurationError: Naming what is wrong, behind ``where``.
        """
        if self.source == LEARNED and not has_learner:
            raise ConfigurationError(f"{where}.source", self.source, f"{LEARNED} only with a learner")
        if self.action not in actions:
            raise ConfigurationError(f"{where}.action", self.action, f"one of {', '.join(actions)}")
        for key in ("q", "visits_per_action"):
            entries = getattr(self, key)
            if has_learner and (entries is None or len(entries) != len(actions)):
                raise ConfigurationError(f"{where}.{key}", entries, f"a list of {len(actions)}")
            if not has_learner and entries is not None:
                raise ConfigurationError(f"{where}.{key}", entries, "null where there is no learner")
        if self.source == LEARNED and self.q is not None and self.q[actions.index(self.action)] != max(self.q):
            best = actions[self.q.index(max(self.q))]
            raise ConfigurationError(f"{where}.action", self.action, f"the action of the highest q, {best}")
        follows = self.of(
            self.state, self.source, self.action, actions.index(self.action), self.q, self.visits_per_action
        )
        for key in ("value", "visits"):
            if (right := getattr(follows, key)) != getattr(self, key):
                raise ConfigurationError(f"{where}.{key}", getattr(self, key), f"{right!r}, as follows from the row")


@dataclass(frozen=True, slots=True)
class LearnerEntry(Settings):
    """The learner behind the table."""

    TABLE: ClassVar[str] = "learner"

    parameters: QParameters
    """Its settings."""
    trials_learned: Annotated[int, Range(0)]
    """Number of trials it learned in."""

    @property
    def kind(self) -> str:
        """Its name in files."""
        return next(kind for kind, settings in LEARNERS.items() if type(self.parameters) is settings)

    def content(self) -> dict[str, Any]:
        """The learner as JSON has it."""
        return {"kind": self.kind, **asdict(self)}

    @classmethod
    @override
    def read(cls, raw: object, where: str = "learner") -> Self:
        given = fitted(where, raw, Mapping[str, Any])
        require_keys(where, given, ("kind", *kinds_of(cls)))
        kind: str = fitted(f"{where}.kind", given["kind"], Annotated[str, OneOf(*LEARNERS)])
        parameters = LEARNERS[kind].read(given["parameters"], f"{where}.parameters")
        trials: int = fitted(f"{where}.trials_learned", given["trials_learned"], kinds_of(cls)["trials_learned"])
        return cls(parameters, trials)
