"""The policy file: the content of a policy, readable by people and exact to the last bit.

JSON with schema id ``palpate.policy/3``. Each row of the table names the knowledge that acts in that state (programmed,
from examples, learned), so that the three are separate on paper too. ``value`` and ``visits`` of a row are for readers;
they must agree with ``q`` and ``visits_per_action``, from which they follow.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import LEARNED, Action
from palpate.core.policy.entries import ActionEntry, LearnerEntry, TableRow
from palpate.core.policy.foreign import ForeignEntry
from palpate.core.policy.model_entry import BeliefEntry, HmmEntry
from palpate.core.ports import OneOf, Settings, load_json, parse_json, require_names, write_whole

SCHEMA: Final = "palpate.policy/3"

_WHOLE: Final = "policy file"


@dataclass(frozen=True, slots=True, kw_only=True)
class PolicyDocument(Settings):
    """The content of a policy file."""

    TABLE: ClassVar[str] = _WHOLE

    schema: Annotated[str, OneOf(SCHEMA)] = SCHEMA
    """Id of the file format."""
    created_with: Mapping[str, Any]
    """Versions of what made it; for readers."""
    perception: Mapping[str, Any]
    """Settings that turn sensor data into these states; opaque here."""
    states: tuple[str, ...]
    """Names of the states."""
    actions: tuple[ActionEntry, ...]
    """The action set."""
    table: tuple[TableRow, ...]
    """One row for each state, in the order of ``states``; with a belief, for those in which it does not act."""
    learner: LearnerEntry | None
    """The learner of the table; None when nothing was learned there."""
    belief: BeliefEntry | None = None
    """The belief that acts in the states without a row; None without."""
    hmm: HmmEntry | None = None
    """The model of hidden states that does so; None without."""
    foreign: ForeignEntry | None = None
    """The policy of others' code that acts in all states, instead of all these; None without."""

    def __post_init__(self) -> None:
        Settings.__post_init__(self)
        # Kept as the file will give it back, and out of reach of whoever made it.
        for name in ("created_with", "perception"):
            object.__setattr__(self, name, _plain(name, getattr(self, name)))

    @property
    def model(self) -> BeliefEntry | HmmEntry | None:
        """What learns by a model, instead of values in the table; None without."""
        return self.belief or self.hmm

    def to_json_text(self) -> str:
        """The text of the file; floats are written so that they read back exactly."""
        content = asdict(replace(self, belief=None, hmm=None)) | {
            "learner": None if self.learner is None else self.learner.content(),
            "belief": None if self.belief is None else self.belief.content(),
            "hmm": None if self.hmm is None else self.hmm.content(),
        }
        for name in ("belief", "hmm", "foreign"):
            if content[name] is None:
                del content[name]
        return json.dumps(content, indent=1, allow_nan=False) + "\n"

    @classmethod
    def from_json_text(cls, text: str) -> PolicyDocument:
        """Read the text of a file; the rows of its table may stand in any order.

        Raises:
            ConfigurationError: It is not a policy file of this schema, or contradicts itself.
        """
        read = cls.read(parse_json(text, _WHOLE, SCHEMA))
        names = [action.name for action in read.actions]
        require_names("states", read.states)
        require_names("actions", names)
        for number, row in enumerate(read.table):
            row.require_consistent(f"table[{number}]", names, read.learner is not None)
        if read.model is not None and read.learner is not None:
            raise ConfigurationError("learner", read.learner.kind, "null beside a belief; one of them learns")
        if read.belief is not None and read.hmm is not None:
            raise ConfigurationError("hmm", read.hmm.TABLE, "none beside a belief; one of them learns")
        if read.foreign is not None and (read.table or read.learner or read.model):
            raise ConfigurationError("foreign", read.foreign.code, "nothing beside an empty table")
        if read.hmm is not None:
            read.hmm.learner(read.states, [action.step() for action in read.actions], frozen=True)
        whole = read.model is None and read.foreign is None
        return replace(read, table=_ordered(read.table, read.states, whole=whole))

    def save(self, path: str | Path) -> None:
        """Write the file as a whole or not at all; an old file stays intact until the new one is complete.

        Raises:
            OutputError: The place cannot be written.
        """
        write_whole(Path(path), self.to_json_text())

    @classmethod
    def load(cls, path: str | Path) -> PolicyDocument:
        """Read a file.

        Raises:
            ConfigurationError: It cannot be read, or :meth:`from_json_text` refuses it.
        """
        return load_json(path, _WHOLE, cls.from_json_text)

    def values(self) -> dict[str, Any]:
        """All that was learned, by the names and in the shapes that the state of a learner has."""
        if self.model is not None:
            return self.model.state()
        if self.foreign is not None:
            return self.foreign.content()
        q = [list(row.q or ()) for row in self.table]
        return {"q": q, "visits": [list(row.visits_per_action or ()) for row in self.table]}

    def unlearned(self) -> PolicyDocument:
        """The same policy before it learned anything: what was programmed and set up, with initial values."""
        if self.belief is not None:
            return replace(self, belief=self.belief.unlearned())
        if self.hmm is not None:
            return replace(self, hmm=self.hmm.unlearned())
        if self.foreign is not None:
            return replace(self, foreign=self.foreign.unlearned())
        if self.learner is None:
            return self
        initial, names = self.learner.parameters.initial_value, [action.name for action in self.actions]
        rows = []
        for row in self.table:
            action = names[0] if row.source == LEARNED else row.action
            q, visits = (initial,) * len(names), (0,) * len(names)
            rows.append(TableRow.of(row.state, row.source, action, names.index(action), q, visits))
        return replace(self, table=tuple(rows), learner=replace(self.learner, trials_learned=0))

    def check_matches(self, states: Sequence[str], actions: Sequence[Action]) -> None:
        """Refuse to serve a task with other states or actions.

        Raises:
            ConfigurationError: Naming the first difference.
        """
        _check_same_names("states", self.states, states)
        _check_same_names("actions", [mine.name for mine in self.actions], [action.name for action in actions])
        for number, (mine, action) in enumerate(zip(self.actions, actions, strict=True)):
            mine.require_same(f"actions[{number}]", ActionEntry.of(action))


def _check_same_names(field: str, mine: Sequence[str], theirs: Sequence[str]) -> None:
    for number, (name, wanted) in enumerate(zip(mine, theirs, strict=False)):
        if name != wanted:
            raise ConfigurationError(f"{field}[{number}]", name, f"{wanted!r}, as in this task")
    if len(mine) != len(theirs):
        raise ConfigurationError(field, f"{len(mine)} of them", f"{len(theirs)} of them, as in this task")


def _plain(where: str, value: Mapping[str, Any]) -> Any:
    """Copy of a value as it will come back from a JSON file."""
    try:
        return json.loads(json.dumps(dict(value), allow_nan=False))
    except (TypeError, ValueError, RecursionError) as error:
        raise ConfigurationError(where, value, f"values that JSON can express ({error})") from error


def _ordered(table: Sequence[TableRow], states: Sequence[str], *, whole: bool) -> tuple[TableRow, ...]:
    """The rows in the order of the states; each state exactly once, or at most once."""
    rows: dict[str, TableRow] = {}
    for number, row in enumerate(table):
        if row.state not in states or row.state in rows:
            raise ConfigurationError(f"table[{number}].state", row.state, "each of the states once, and no other")
        rows[row.state] = row
    missing = [state for state in states if state not in rows]
    if missing and whole:
        raise ConfigurationError("table", f"no row for {missing[0]!r}", "one row for each of the states")
    return tuple(rows[state] for state in states if state in rows)
