"""The parts of a policy file - action, row of the table, learner - as JSON has them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import degrees, isclose
from typing import Annotated, Any, ClassVar, Final, Self

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import EXAMPLES, LEARNED, PROGRAMMED, Action, Law
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
class ActionEntry(Settings):
    """One action of the file."""

    UNTOLD: ClassVar[Mapping[str, Any]] = {
        "law": "", "rise_mm": 0.0, "turn_deg": (0.0, 0.0, 0.0), "push_N": (0.0, 0.0), "pivot_mm": (0.0, 0.0),
    }  # fmt: skip

    name: str
    """Its name."""
    displacement_mm: tuple[float, float]
    """XY displacement of the tip, (2,), in the task frame."""
    law: Annotated[str, OneOf("", *(law.value for law in Law))] = ""
    """Control law of an action in six degrees of freedom; empty for a step across, which has none of what follows."""
    rise_mm: float = 0.0
    """By how much it lifts the tip."""
    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """By how much it turns the tool: lean about x and y, and yaw."""
    push_N: tuple[float, float] = (0.0, 0.0)
    """Force with which it pushes."""
    pivot_mm: tuple[float, float] = (0.0, 0.0)
    """Point of the end face about which it turns."""

    @classmethod
    def of(cls, action: Action) -> Self:
        """A live action as the file has it."""
        displacement_mm, spatial = _scaled(action.displacement_m, 1e3), action.spatial
        if spatial is None:
            return cls(action.name, displacement_mm)
        lean_x, lean_y, yaw = map(degrees, spatial.turn_rad)
        turn_deg, pivot_mm = (lean_x, lean_y, yaw), _scaled(spatial.pivot_m, 1e3)
        rise_mm = 1e3 * spatial.rise_m
        return cls(action.name, displacement_mm, spatial.law.value, rise_mm, turn_deg, spatial.push_N, pivot_mm)

    def step(self) -> Action:
        """The step across, live; rounded to mm, which may cost the last bit."""
        return Action(self.name, _scaled(self.displacement_mm, 1e-3))

    def content(self) -> dict[str, Any]:
        """The action as JSON has it: of a step across, no more than ever."""
        written = asdict(self)
        return written if self.law else {"name": self.name, "displacement_mm": self.displacement_mm}

    def differs(self, other: Self) -> str:
        """The first of its fields that is not the same, however the numbers were rounded; empty for none."""
        mine, theirs = asdict(self), asdict(other)
        for name, value in mine.items():
            wanted = theirs[name]
            if isinstance(value, str):
                if value != wanted:
                    return name
            elif not all(map(_same, *(x if isinstance(x, tuple) else (x,) for x in (value, wanted)))):
                return name
        return ""


def _scaled(pair: tuple[float, float], factor: float) -> tuple[float, float]:
    return factor * pair[0], factor * pair[1]


def _same(a: float, b: float) -> bool:
    """Far below any arm's resolution in mm, degrees and N, far above the rounding on the way to them."""
    return isclose(a, b, rel_tol=0.0, abs_tol=1e-6)


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
    """The learner behind the table. In the file its settings stand beside the rest, and a rate that stays is null."""

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
        settings = asdict(self.parameters)
        schedule = {key: value for key, value in settings.pop("temperature").items() if value is not None}
        temperature = {"temperature": schedule, "trials_learned": self.trials_learned}
        return {"kind": self.kind, **settings, "alpha_visits": settings["alpha_visits"] or None, **temperature}

    @classmethod
    @override
    def read(cls, raw: object, where: str = "learner") -> Self:
        given = fitted(where, raw, Mapping[str, Any])
        kind: str = fitted(f"{where}.kind", given.get("kind"), Annotated[str, OneOf(*LEARNERS)])
        settings = LEARNERS[kind]
        given = {**settings.UNTOLD, **given}
        require_keys(where, given, ("kind", *kinds_of(settings), "trials_learned"))
        values = {key: given[key] for key in kinds_of(settings)}
        if values["alpha_visits"] == 0.0:
            raise ConfigurationError(f"{where}.alpha_visits", 0.0, "a number above 0, or null for none")
        parameters = settings.read(values | {"alpha_visits": values["alpha_visits"] or 0.0}, where)
        return cls(
            parameters, fitted(f"{where}.trials_learned", given["trials_learned"], kinds_of(cls)["trials_learned"])
        )
