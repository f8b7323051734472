"""The policy file: what a policy knows, readable by people and exact to the last bit.

JSON with schema id ``palpate.policy/1``; ``policy.schema.json`` beside this file describes it formally.
Each row of the table says which knowledge decides in that state (programmed, from examples, learned), so
that the three stay apart on paper too. ``value`` and ``visits`` of a row are there for readers; they must
agree with ``q`` and ``visits_per_action``, from which they follow.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import isclose
from pathlib import Path
from typing import Any, Final

from palpate.core.errors import PolicyFileError
from palpate.core.files import write_whole
from palpate.core.policy.base import LEARNED, Action
from palpate.core.policy.entries import ActionEntry, LearnerEntry, TableRow
from palpate.core.policy.parsing import parse_json, plain_json, read_list, read_object, read_text

SCHEMA: Final = "palpate.policy/1"

_KEYS: Final = ("schema", "created_with", "perception", "states", "actions", "table", "learner")
_SAME_STEP_MM: Final = 1e-6  # far below any arm's resolution, far above the rounding of metres to mm


@dataclass(frozen=True, slots=True)
class PolicyDocument:
    """The content of a policy file.

    Attributes:
        created_with: Versions of what made it; for readers.
        perception: Settings that turn sensor data into these states; opaque here.
        states: Names of the states.
        actions: The action set.
        table: One row for each state, in the order of ``states``.
        learner: The learner; None when nothing was learned.
    """

    created_with: Mapping[str, Any]
    perception: Mapping[str, Any]
    states: tuple[str, ...]
    actions: tuple[ActionEntry, ...]
    table: tuple[TableRow, ...]
    learner: LearnerEntry | None

    def __post_init__(self) -> None:
        # Kept as the file will give it back, and out of reach of whoever made it.
        object.__setattr__(self, "created_with", plain_json("created_with", dict(self.created_with)))
        object.__setattr__(self, "perception", plain_json("perception", dict(self.perception)))

    def to_json_text(self) -> str:
        """The text of the file; floats are written so that they read back exactly.

        Raises:
            PolicyFileError: A Q is not finite, because learning diverged.
        """
        content = {
            "schema": SCHEMA,
            "created_with": self.created_with,
            "perception": self.perception,
            "states": self.states,
            "actions": [asdict(action) for action in self.actions],
            "table": [row.content() for row in self.table],
            "learner": None if self.learner is None else self.learner.content(),
        }
        try:
            return json.dumps(content, indent=1, allow_nan=False) + "\n"
        except ValueError as error:
            raise PolicyFileError("table", "a number that is not finite", "finite numbers only") from error

    @classmethod
    def from_json_text(cls, text: str) -> PolicyDocument:
        """Read the text of a file.

        Raises:
            PolicyFileError: It is not a policy file of this schema, or contradicts itself.
        """
        raw = read_object("policy file", parse_json(text))
        # Before anything else: a file of another schema may have other keys.
        if raw.get("schema") != SCHEMA:
            accepted = f"{SCHEMA!r}; a newer schema needs a newer palpate"
            raise PolicyFileError("schema", raw.get("schema"), accepted)
        raw = read_object("policy file", raw, _KEYS)
        states = _read_names("states", read_list("states", raw["states"]))
        entries = read_list("actions", raw["actions"])
        actions = tuple(ActionEntry.read(f"actions[{n}]", entry) for n, entry in enumerate(entries))
        names = _read_names("actions", [action.name for action in actions])
        learner = None if raw["learner"] is None else LearnerEntry.read(raw["learner"])
        table = _read_table(read_list("table", raw["table"]), states, list(names), learner is not None)
        if learner is not None and learner.back_off is not None:
            learner.back_off.check_table([row.q or () for row in table], [row.visits_per_action or () for row in table])
        return cls(
            created_with=read_object("created_with", raw["created_with"]),
            perception=read_object("perception", raw["perception"]),
            states=states,
            actions=actions,
            table=table,
            learner=learner,
        )

    def save(self, path: str | Path) -> None:
        """Write the file as a whole or not at all; an old file stays intact until the new one is complete.

        Raises:
            PolicyFileError: A Q is not finite.
            OutputError: The place cannot be written.
        """
        write_whole(Path(path), self.to_json_text())

    @classmethod
    def load(cls, path: str | Path) -> PolicyDocument:
        """Read a file.

        Raises:
            PolicyFileError: It cannot be read, or :meth:`from_json_text` refuses it.
        """
        try:
            return cls.from_json_text(Path(path).read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError) as error:
            raise PolicyFileError("policy file", str(path), f"a readable file in UTF-8 ({error})") from error
        except PolicyFileError as error:
            raise PolicyFileError(f"{path}: {error.field}", error.value, error.accepted) from error

    def values(self) -> dict[str, Any]:
        """All that was learned, by the names and in the shapes that the state of a learner has."""
        back_off = None if self.learner is None else self.learner.back_off
        learned = {} if back_off is None else back_off.values()
        q = [list(row.q or ()) for row in self.table]
        return {"q": q, "visits": [list(row.visits_per_action or ()) for row in self.table]} | learned

    def unlearned(self) -> PolicyDocument:
        """The same policy before it learned anything: what was programmed and set up, with initial values."""
        if self.learner is None:
            return self
        initial, actions = self.learner.parameters.initial_value, self.actions
        rows = []
        for row in self.table:
            fresh = replace(row, q=(initial,) * len(actions), visits_per_action=(0,) * len(actions))
            rows.append(replace(fresh, action=actions[0].name, best=0) if row.source == LEARNED else fresh)
        back_off = self.learner.back_off
        blank = None if back_off is None else back_off.blank(initial)
        return replace(self, table=tuple(rows), learner=replace(self.learner, trials_learned=0, back_off=blank))

    def check_matches(self, states: Sequence[str], actions: Sequence[Action]) -> None:
        """Refuse to serve a task with other states or actions.

        Raises:
            PolicyFileError: Naming the first difference.
        """
        _check_same_names("states", self.states, states)
        _check_same_names("actions", [mine.name for mine in self.actions], [action.name for action in actions])
        for number, (mine, action) in enumerate(zip(self.actions, actions, strict=True)):
            wanted_mm = ActionEntry.of(action).displacement_mm
            if not all(map(_same_length, mine.displacement_mm, wanted_mm)):
                where = f"actions[{number}].displacement_mm"
                raise PolicyFileError(where, mine.displacement_mm, f"{wanted_mm}, as in this task")


def _same_length(a_mm: float, b_mm: float) -> bool:
    return isclose(a_mm, b_mm, rel_tol=0.0, abs_tol=_SAME_STEP_MM)


def _check_same_names(field: str, mine: Sequence[str], theirs: Sequence[str]) -> None:
    for number, (name, wanted) in enumerate(zip(mine, theirs, strict=False)):
        if name != wanted:
            raise PolicyFileError(f"{field}[{number}]", name, f"{wanted!r}, as in this task")
    if len(mine) != len(theirs):
        raise PolicyFileError(field, f"{len(mine)} of them", f"{len(theirs)} of them, as in this task")


def _read_names(where: str, raw: list[Any]) -> tuple[str, ...]:
    names = tuple(read_text(f"{where}[{number}]", name) for number, name in enumerate(raw))
    if not names:
        raise PolicyFileError(where, raw, "at least one")
    for number, name in enumerate(names):
        if not (name and name.isprintable()) or name in names[:number]:
            raise PolicyFileError(f"{where}[{number}]", name, "a printable name, and none twice")
    return names


def _read_table(raw: list[Any], states: tuple[str, ...], actions: list[str], has_learner: bool) -> tuple[TableRow, ...]:
    """Rows in any order; each state exactly once."""
    rows: dict[str, TableRow] = {}
    for number, entry in enumerate(raw):
        row = TableRow.read(f"table[{number}]", entry, actions, has_learner)
        if row.state not in states or row.state in rows:
            raise PolicyFileError(f"table[{number}].state", row.state, "each of the states once, and no other")
        rows[row.state] = row
    missing = [state for state in states if state not in rows]
    if missing:
        raise PolicyFileError("table", f"no row for {missing[0]!r}", "one row for each of the states")
    return tuple(rows[state] for state in states)


_HEADER = ("state", "source", "best action", "value", "visits")


def render_table(document: PolicyDocument) -> str:
    """State, source, best action, value and visits in aligned columns, in the order of the states.

    The best action of a learned state that was never visited is not shown: all actions are equal there.
    """
    learner = document.learner
    learned = f"{learner.kind}, {learner.trials_learned} trials learned" if learner else "nothing learned"
    lines = [_HEADER, *(_cells(row) for row in document.table)]
    widths = [max(len(cells[column]) for cells in lines) for column in range(len(_HEADER))]
    return "\n".join(
        [f"{len(document.states)} states, {len(document.actions)} actions; {learned}", ""]
        + [_aligned(cells, widths) for cells in lines]
    )


def _cells(row: TableRow) -> tuple[str, ...]:
    if row.value is None:
        return row.state, row.source, row.action, "-", "-"
    if row.visits == 0:
        action = "-" if row.source == LEARNED else row.action
        return row.state, row.source, action, "-", "never visited"
    return row.state, row.source, row.action, f"{row.value:.3f}", str(row.visits)


def _aligned(cells: tuple[str, ...], widths: list[int]) -> str:
    texts = [cell.ljust(width) for cell, width in zip(cells[:3], widths[:3], strict=True)]
    numbers = [cell.rjust(width) for cell, width in zip(cells[3:], widths[3:], strict=True)]
    return "  ".join(texts + numbers).rstrip()
