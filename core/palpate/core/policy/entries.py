"""The parts of a policy file - action, row of the table, learner - and how each is read from JSON."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Final

from palpate.core.errors import ConfigurationError, PolicyFileError
from palpate.core.policy.back_off_entry import BackOffEntry
from palpate.core.policy.base import EXAMPLES, LEARNED, PROGRAMMED, Action
from palpate.core.policy.exploration import TemperatureSchedule
from palpate.core.policy.parsing import read_count, read_list, read_number, read_object, read_text
from palpate.core.policy.sarsa import SarsaParameters
from palpate.core.policy.tabular import QParameters

LEARNERS: Final[dict[str, type[QParameters]]] = {"q-learning": QParameters, "sarsa": SarsaParameters}
"""Kinds of learners in files, and the settings that each has."""
SOURCES: Final = (PROGRAMMED, EXAMPLES, LEARNED)

_ROW_KEYS: Final = ("state", "source", "action", "value", "visits", "q", "visits_per_action")
_SETTING_KEYS: Final = ("alpha", "gamma", "alpha_visits", "alpha_floor", "initial_value")


@dataclass(frozen=True, slots=True)
class ActionEntry:
    """One action of the file.

    Attributes:
        name: Its name.
        displacement_mm: XY displacement of the tip, (2,), in the task frame.
    """

    name: str
    displacement_mm: tuple[float, float]

    @classmethod
    def of(cls, action: Action) -> ActionEntry:
        """A live action as the file has it."""
        x_m, y_m = action.displacement_m
        return cls(action.name, (1e3 * x_m, 1e3 * y_m))

    @classmethod
    def read(cls, where: str, raw: object) -> ActionEntry:
        """Read it from JSON.

        Raises:
            PolicyFileError: It is not an action.
        """
        entry = read_object(where, raw, ("name", "displacement_mm"))
        x_mm, y_mm = read_list(f"{where}.displacement_mm", entry["displacement_mm"], 2)
        return cls(
            read_text(f"{where}.name", entry["name"]),
            (
                read_number(f"{where}.displacement_mm[0]", x_mm),
                read_number(f"{where}.displacement_mm[1]", y_mm),
            ),
        )


@dataclass(frozen=True, slots=True)
class TableRow:
    """What is known for one state.

    Attributes:
        state: Its name.
        source: Which knowledge decides: ``"programmed"``, ``"examples"`` or ``"learned"``.
        action: Name of the assigned action, or of the best one that was learned.
        best: Index of that action.
        q: Q of each action, (n actions,); None without a learner.
        visits_per_action: How often each action was learned from; None without a learner.
    """

    state: str
    source: str
    action: str
    best: int
    q: tuple[float, ...] | None
    visits_per_action: tuple[int, ...] | None

    @property
    def value(self) -> float | None:
        """Q of the row's action; None without a learner."""
        return None if self.q is None else self.q[self.best]

    @property
    def visits(self) -> int:
        """How often the learner learned from this state."""
        return sum(self.visits_per_action or ())

    def content(self) -> dict[str, Any]:
        """The row as JSON has it."""
        return {key: getattr(self, key) for key in _ROW_KEYS}

    @classmethod
    def read(cls, where: str, raw: object, actions: list[str], has_learner: bool) -> TableRow:
        """Read it from JSON.

        Raises:
            PolicyFileError: It is not a row over these actions, or contradicts itself.
        """
        entry = read_object(where, raw, _ROW_KEYS)
        state, source, action = (read_text(f"{where}.{key}", entry[key]) for key in ("state", "source", "action"))
        if source not in SOURCES or (source == LEARNED and not has_learner):
            accepted = f"one of {', '.join(SOURCES)}; {LEARNED} only with a learner"
            raise PolicyFileError(f"{where}.source", source, accepted)
        if action not in actions:
            raise PolicyFileError(f"{where}.action", action, f"one of {', '.join(actions)}")
        q: tuple[float, ...] | None = None
        visits: tuple[int, ...] | None = None
        if has_learner:
            values = read_list(f"{where}.q", entry["q"], len(actions))
            q = tuple(read_number(f"{where}.q[{n}]", value) for n, value in enumerate(values))
            counts = read_list(f"{where}.visits_per_action", entry["visits_per_action"], len(actions))
            visits = tuple(read_count(f"{where}.visits_per_action[{n}]", count) for n, count in enumerate(counts))
        else:
            for key in ("q", "visits_per_action"):
                if entry[key] is not None:
                    raise PolicyFileError(f"{where}.{key}", entry[key], "null where there is no learner")
        row = cls(state, source, action, actions.index(action), q, visits)
        row._check_consistent(where, entry, actions)
        return row

    def _check_consistent(self, where: str, entry: dict[str, Any], actions: list[str]) -> None:
        if self.source == LEARNED and self.q is not None and self.value != max(self.q):
            best = actions[self.q.index(max(self.q))]
            raise PolicyFileError(f"{where}.action", self.action, f"the action of the highest q, {best}")
        for key, follows in (("value", self.value), ("visits", self.visits)):
            if entry[key] != follows or isinstance(entry[key], bool):
                raise PolicyFileError(f"{where}.{key}", entry[key], f"{follows!r}, as follows from the row")


@dataclass(frozen=True, slots=True)
class LearnerEntry:
    """The learner behind the table.

    Attributes:
        parameters: Its settings.
        trials_learned: Number of trials it learned in.
        back_off: What it backs off to where states were little tried; None where it does not.
    """

    parameters: QParameters
    trials_learned: int
    back_off: BackOffEntry | None = None

    @property
    def kind(self) -> str:
        """Its name in files."""
        return next(kind for kind, settings in LEARNERS.items() if type(self.parameters) is settings)

    def content(self) -> dict[str, Any]:
        """The learner as JSON has it."""
        settings = {key: getattr(self.parameters, key) for key in _setting_keys(type(self.parameters))}
        # In the file a rate that stays is null.
        settings["alpha_visits"] = settings["alpha_visits"] or None
        temperature = asdict(self.parameters.temperature)
        content = {"kind": self.kind} | settings | {"temperature": temperature, "trials_learned": self.trials_learned}
        return content if self.back_off is None else content | {"back_off": self.back_off.content()}

    @classmethod
    def read(cls, raw: object) -> LearnerEntry:
        """Read it from JSON.

        Raises:
            PolicyFileError: It is no learner that there is, or its settings are out of range.
        """
        given = read_object("learner", raw)
        kind = given.get("kind")
        settings_of = LEARNERS.get(kind) if isinstance(kind, str) else None
        if settings_of is None:
            raise PolicyFileError("learner.kind", kind, f"one of {', '.join(LEARNERS)}")
        keys = _setting_keys(settings_of)
        backs_off = ("back_off",) if "back_off" in given and settings_of is QParameters else ()
        entry = read_object("learner", raw, ("kind", *keys, "temperature", "trials_learned", *backs_off))
        settings = {
            key: read_number(f"learner.{key}", entry[key])
            for key in keys
            if not (key == "alpha_visits" and entry[key] is None)
        }
        if settings.get("alpha_visits") == 0.0:
            raise PolicyFileError("learner.alpha_visits", entry["alpha_visits"], "a number above 0, or null for none")
        schedule = read_object("learner.temperature", entry["temperature"], ("initial", "decay", "floor"))
        schedule = {key: read_number(f"learner.temperature.{key}", value) for key, value in schedule.items()}
        try:
            parameters = settings_of(**settings, temperature=TemperatureSchedule(**schedule))
        except ConfigurationError as error:
            field = error.field.replace("policy.", "learner.", 1)
            raise PolicyFileError(field, error.value, error.accepted) from error
        back_off = BackOffEntry.read(entry["back_off"]) if backs_off else None
        return cls(parameters, read_count("learner.trials_learned", entry["trials_learned"]), back_off)


def _setting_keys(settings: type[QParameters]) -> tuple[str, ...]:
    return (*_SETTING_KEYS, "trace_decay") if settings is SarsaParameters else _SETTING_KEYS
