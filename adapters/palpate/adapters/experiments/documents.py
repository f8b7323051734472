"""Files with learned policies, automata and examples."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from palpate.adapters.files import read_text, write_whole
from palpate.core.automata import Machine, from_json_text
from palpate.core.errors import ConfigurationError
from palpate.core.policy import Action, PolicyDocument, check_known

_EXAMPLES = "policy.examples"
T = TypeVar("T")


def load_policy(path: str | Path) -> PolicyDocument:
    """Read a policy file.

    Raises:
        ConfigurationError: The file cannot be read, or its contents are rejected.
    """
    return _loaded(path, PolicyDocument.TABLE, PolicyDocument.from_json_text)


def save_policy(document: PolicyDocument, path: Path) -> None:
    """Write a policy file atomically; an old file stays intact until the new one is complete.

    Raises:
        OSError: The file cannot be written.
    """
    write_whole(path, document.to_json_text())


def load_automaton(path: str | Path) -> Machine:
    """Read an automaton file.

    Raises:
        ConfigurationError: The file cannot be read, or its contents are rejected.
    """
    return _loaded(path, "automaton file", from_json_text)


def _loaded(path: str | Path, whole: str, read: Callable[[str], T]) -> T:
    text = read_text(path, whole)
    try:
        return read(text)
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error.field}", error.value, error.accepted) from error


def load_examples(
    path: str | Path, states: Sequence[str] | None = None, actions: Sequence[Action] | None = None
) -> tuple[tuple[str, str], ...]:
    """Return pairs of state and action names from a CSV file, such as a run's ``decisions.csv``, in file order.

    Other columns are ignored. Names are checked if ``states`` and ``actions`` are given.

    Raises:
        ConfigurationError: The file cannot be used; the error gives the file and the line.
    """
    reader = csv.DictReader(io.StringIO(read_text(path, _EXAMPLES, newline=""), newline=""), strict=True)
    examples = []
    try:
        header = list(reader.fieldnames or ())
        for column in ("state", "action"):
            if header.count(column) != 1:
                raise ConfigurationError(f"{_EXAMPLES}: {path}:1", header, f"one column called {column!r}")
        for row in reader:
            where = f"{_EXAMPLES}: {path}:{reader.line_num}"
            state, action = row["state"], row["action"]
            if not state or not action:
                raise ConfigurationError(where, (state, action), "a state and an action in every line")
            if states is not None and actions is not None:
                check_known(where, state, action, states, actions)
            examples.append((state, action))
    except csv.Error as error:
        # Only the inner reader has counted the invalid line.
        raise ConfigurationError(
            f"{_EXAMPLES}: {path}:{reader.reader.line_num}", str(error), "well-formed CSV"
        ) from error
    if not examples:
        raise ConfigurationError(
            f"{_EXAMPLES}: {path}", "no examples", "a file with at least one line below its header"
        )
    return tuple(examples)
