"""``summary.csv``: one line a cell."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from palpate.adapters.experiments.study.cell import StudyCell
from palpate.adapters.experiments.study.document import Study
from palpate.adapters.experiments.study.fields import setting

_TOLD: Final = ("scenario", "arm", "seed", "policy", "finished")
"""Of a summary; the cell's own columns say it, or the line itself does."""
_COUNTS: Final = ("outcomes", "marked_why")


def table_of(study: Study, rows: Sequence[tuple[StudyCell, Mapping[str, Any]]]) -> str:
    """The table as CSV.

    Args:
        study: Tells settings that a cell leaves as they are.
        rows: Finished cells and the figures of their ``summary.json``.
    """
    fields = list(dict.fromkeys(name for one in (*study.listed, study.grid) for name in one))
    flat = [dict(_flat(figures)) for _, figures in rows]
    columns = _columns(flat)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["cell", *fields, "policy", "seed", *(".".join(name) for name in columns)])
    for (cell, _), values in zip(rows, flat, strict=True):
        # A cell of a list may leave settings as they are that others name.
        left = {name for name in fields if name not in cell.fields}
        config = study.config(cell.fields) if left else None
        known = [setting(config, name) if name in left else cell.fields[name] for name in fields]
        # An outcome that a cell does not name never came about; other figures it may not have.
        figures = (values.get(name, 0 if name[0] in _COUNTS else "") for name in columns)
        writer.writerow([cell.name, *map(_word, known), cell.policy, cell.seed, *figures])
    return text.getvalue()


def _columns(rows: Sequence[Mapping[tuple[str, ...], Any]]) -> list[tuple[str, ...]]:
    """All columns of all rows, those of one table beside each other."""
    tables: dict[str, dict[tuple[str, ...], None]] = {}
    for row in rows:
        for name in row:
            tables.setdefault(name[0], {})[name] = None
    return [name for table in tables.values() for name in table]


def _flat(figures: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], Any]]:
    for name, value in figures.items():
        if name in _TOLD:
            continue
        if isinstance(value, Mapping):
            yield from (((name, inner), figure) for inner, figure in value.items())
        elif isinstance(value, list):
            low, high = value
            yield from (((f"{name}_low",), low), ((f"{name}_high",), high))
        else:
            yield (name,), value


def _word(value: Any) -> Any:
    return json.dumps(value, ensure_ascii=False) if isinstance(value, (list, dict)) else value
