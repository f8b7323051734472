"""The settings as they are declared: names, types, ranges and defaults, against a copy that a person keeps.

Tests that go by the declaration cannot see that it is wrong. After a change on purpose write the copy again with
``PALPATE_SNAPSHOT=write pytest tests/unit/adapters/config/test_run_snapshot.py``, and look at the difference.
"""

import json
import os
from pathlib import Path
from typing import Any, get_args, get_origin

from palpate.core.ports.settings import Range, Settings, kinds_of, optional_of, parts_of
from tests.unit.adapters.config.declared import TABLES

SNAPSHOT = Path(__file__).parents[3] / "golden" / "settings.json"


def declared(table: Settings) -> dict[str, Any]:
    """Each setting of a table as a line, or as a table of its own."""
    found = {}
    for name, kind in kinds_of(type(table)).items():
        value = getattr(table, name)
        found[name] = declared(value) if isinstance(value, Settings) else f"{_kind(kind)} = {value!r}"
    return found


def _kind(kind: Any) -> str:
    base, marks = parts_of(kind)
    if (inner := optional_of(base)) is not None:
        return f"{_kind(inner)}, or none"
    units = [mark.unit for mark in marks if isinstance(mark, Range) and mark.unit]
    return ", ".join([_named(base), *(mark.words(base) for mark in marks), *units])


def _named(base: Any) -> str:
    if get_origin(base) not in (tuple, dict):
        return " or ".join(one.__name__ for one in get_args(base) or (base,))
    items = ("..." if item is ... else _kind(item) for item in get_args(base))
    return f"{base.__name__}[{'; '.join(items)}]"


def test_the_declared_settings_are_those_of_the_snapshot() -> None:
    found = {name: declared(base) for name, base in TABLES.items()}
    text = json.dumps(found, indent=1, ensure_ascii=False) + "\n"
    if os.environ.get("PALPATE_SNAPSHOT") == "write":
        SNAPSHOT.write_text(text, encoding="utf-8")
    assert text == SNAPSHOT.read_text(encoding="utf-8")
