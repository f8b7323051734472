"""Knowledge from examples: state-action pairs stored by other runs (paper, section 3.5)."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import EXAMPLES, Action
from palpate.core.policy.programmed import AssignedPolicy, check_known
from palpate.core.ports import whole_text

_FIELD = "policy.examples"


class ExamplesPolicy(AssignedPolicy):
    """Takes the action that most examples show for the state; of equals, the first of the action set.

    States without an example are left to another policy.

    Raises:
        ConfigurationError: ``policy.examples`` names a state or an action that there is not.
    """

    def __init__(self, states: Sequence[str], actions: Sequence[Action], examples: Iterable[tuple[str, str]]) -> None:
        row = {state: number for number, state in enumerate(states)}
        column = {action.name: number for number, action in enumerate(actions)}
        counts = [[0] * len(actions) for _ in states]
        for state, action in examples:
            check_known(_FIELD, state, action, states, actions)
            counts[row[state]][column[action]] += 1
        assigned = [line.index(max(line)) if any(line) else None for line in counts]
        super().__init__(states, actions, assigned, EXAMPLES)


def load_examples(
    path: str | Path, states: Sequence[str] | None = None, actions: Sequence[Action] | None = None
) -> tuple[tuple[str, str], ...]:
    """Pairs of a state's and an action's name from a CSV file, such as the ``decisions.csv`` of a run, in its order.

    Args:
        path: A file with a header line that has at least ``state`` and ``action``; other columns are
            ignored.
        states: When given with ``actions``, names are checked here, where the line is still known.

    Raises:
        ConfigurationError: The file cannot be used; with the file and the line.
    """
    try:
        with whole_text(path, newline="") as lines:
            return _read_examples(csv.DictReader(lines, strict=True), str(path), states, actions)
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(_FIELD, str(path), f"a readable CSV file in UTF-8 ({error})") from error


def _read_examples(
    reader: csv.DictReader[str], path: str, states: Sequence[str] | None, actions: Sequence[Action] | None
) -> tuple[tuple[str, str], ...]:
    examples = []
    try:
        header = list(reader.fieldnames or ())
        for column in ("state", "action"):
            if header.count(column) != 1:
                raise ConfigurationError(f"{_FIELD}: {path}:1", header, f"one column called {column!r}")
        for row in reader:
            where = f"{_FIELD}: {path}:{reader.line_num}"
            state, action = row["state"], row["action"]
            if not state or not action:
                raise ConfigurationError(where, (state, action), "a state and an action in every line")
            if states is not None and actions is not None:
                check_known(where, state, action, states, actions)
            examples.append((state, action))
    except csv.Error as error:
        # The inner reader has counted the line that failed, the outer one has not.
        raise ConfigurationError(f"{_FIELD}: {path}:{reader.reader.line_num}", str(error), "well-formed CSV") from error
    if not examples:
        raise ConfigurationError(f"{_FIELD}: {path}", "no examples", "at least one line below the header")
    return tuple(examples)
