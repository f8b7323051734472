"""Export a log to CSV and JSON files, exact to the last bit.

Columns are named after the fields of a record, with x, y, z or numbers from 1 for the components of vectors. Floats are
written with ``repr`` so that they can be read back exactly. An empty cell means a missing value.
"""

import dataclasses
import json
from collections.abc import Iterable, Sequence
from enum import Enum
from pathlib import Path
from typing import Any, Final

from palpate.adapters.files import new_folder
from palpate.adapters.log.json_text import finite, json_in
from palpate.adapters.log.reader import TrialLog, read_log
from palpate.adapters.log.records import CallEntry, DecisionEntry, EventEntry, LossEntry, TickRecord
from palpate.adapters.log.tables import csv_text
from palpate.core.ports import AppliedCommand

_WITH_PARTS: Final = frozenset({"wrench", "joints", "requested_rad", "applied"})
_SPATIAL: Final = frozenset({"force_N", "torque_Nm", "displacement_m"})


def export_csv(paths: Sequence[Path], out: Path) -> list[Path]:
    """Export logs to a new folder, with one subfolder per log if there are several. Return the logs' folders.

    Raises:
        LogError: A log cannot be read; nothing is written.
        OutputError: The folder cannot be written.
    """
    names = [""] if len(paths) == 1 else names_for(paths)
    with new_folder(out) as passing:
        for path, name in zip(paths, names, strict=True):
            folder = passing / name
            folder.mkdir(exist_ok=True)
            _write_log(read_log(path), folder)
    return [out / name for name in names]


def names_for(paths: Sequence[Path]) -> list[str]:
    """Return file names without a suffix, with numbers added to duplicates."""
    names: list[str] = []
    for path in paths:
        name, number = path.stem, 1
        while name in names:
            number += 1
            name = f"{path.stem}-{number}"
        names.append(name)
    return names


def _write_log(log: TrialLog, folder: Path) -> None:
    earned = {
        entry.number: {"reinforcement": entry.reinforcement, "reinforcement_tick": entry.tick}
        for entry in log.reinforcements
    }
    decisions = [_flat(entry) | earned.get(entry.number, {}) for entry in log.decisions]
    _write(folder / "ticks.csv", TickRecord, map(_flat, log.records()))
    _write(folder / "calls.csv", CallEntry, map(_flat, log.calls))
    _write(folder / "decisions.csv", DecisionEntry, decisions)
    _write(folder / "events.csv", EventEntry, map(_flat, log.events))
    _write(folder / "recorder.csv", LossEntry, map(_flat, log.losses))
    (folder / "config.toml").write_text(log.start.config_toml, encoding="utf-8")
    for name, record in (("start", log.start), ("end", log.end)):
        if record is not None:
            text = json.dumps(finite(_unfolded(log, name, record)), indent=2, ensure_ascii=False, allow_nan=False)
            (folder / f"{name}.json").write_text(text + "\n", encoding="utf-8")


def _flat(entry: Any, before: str = "") -> dict[str, Any]:
    """Flatten a record, including the fields of its samples and the components of its vectors."""
    row: dict[str, Any] = {}
    for field in dataclasses.fields(entry):
        value, name = getattr(entry, field.name), before + field.name
        if isinstance(value, AppliedCommand):
            row |= _parts(f"{name}_rad", value.position_rad) | {"reason": value.reason.value}
        elif dataclasses.is_dataclass(value):
            row |= _flat(value, f"{name}_")
        elif isinstance(value, tuple):
            row |= _parts(name, value, "xyz" if field.name in _SPATIAL else "")
        elif value is not None or name not in _WITH_PARTS:
            row[name] = value.value if isinstance(value, Enum) else value
    return row


def _parts(name: str, values: Sequence[float], axes: str = "") -> dict[str, float]:
    return {f"{name}_{axes[i] if axes else i + 1}": value for i, value in enumerate(values)}


def _write(path: Path, kind: type, rows: Iterable[dict[str, Any]]) -> None:
    """Write a table with the columns of all its rows, or with the record's fields if it has no rows."""
    every = list(rows)
    columns = dict.fromkeys(name for row in every for name in row) or [field.name for field in dataclasses.fields(kind)]
    text = csv_text([list(columns), *([row.get(name) for name in columns] for row in every)])
    path.write_text(text, encoding="utf-8", newline="")


def _unfolded(log: TrialLog, message: str, record: Any) -> dict[str, Any]:
    """Return the record's fields, with JSON texts parsed and named without ``_json``."""
    fields: dict[str, Any] = {"log": log.path}
    for name, value in dataclasses.asdict(record).items():
        if name.endswith("_json"):
            fields[name.removesuffix("_json")] = json_in(log, f"{message}.{name}", value) if value else None
        elif name != "config_toml":
            fields[name] = value
    return fields
