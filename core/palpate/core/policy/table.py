"""A policy as a table for people: ``palpate show policy.json``."""

from __future__ import annotations

from palpate.core.policy.base import LEARNED
from palpate.core.policy.entries import TableRow
from palpate.core.policy.file import PolicyDocument

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
