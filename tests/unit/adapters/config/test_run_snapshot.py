"""The settings as they are declared: types, ranges, units, defaults and help texts, against a copy that a person keeps.

Tests that go by the declaration cannot see that it is wrong. Whoever changes a setting on purpose writes the copy anew:
``PALPATE_SNAPSHOT=write pytest tests/unit/adapters/config/test_run_snapshot.py``, and looks at the difference.
"""

import json
import os
from pathlib import Path

from palpate.core.ports.json_schema import json_schema
from tests.unit.adapters.config.declared import TABLES

SNAPSHOT = Path(__file__).parents[3] / "golden" / "settings.json"


def test_the_declared_settings_are_those_of_the_snapshot() -> None:
    text = json.dumps({name: json_schema(type(base)) for name, base in TABLES.items()}, indent=1, ensure_ascii=False)
    if os.environ.get("PALPATE_SNAPSHOT") == "write":
        SNAPSHOT.write_text(text + "\n", encoding="utf-8")
    assert text + "\n" == SNAPSHOT.read_text(encoding="utf-8")
