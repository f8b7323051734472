"""A log as CSV and JSON files, with every bit of every number.

Floats are written by ``repr``, so that they read back exactly; what was not there is an empty cell.
"""

import csv
import dataclasses
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from palpate.adapters.log.file import finite, json_in
from palpate.adapters.log.reader import TrialLog, read_log
from palpate.adapters.log.records import CallEntry, EventEntry, LossEntry, TickRecord
from palpate.core.ports import JointSample, WrenchSample, new_folder

_TIMES: Final = ("source_time_ns", "receive_time_ns", "sequence")
_WRENCH: Final = (
    "force_x_N", "force_y_N", "force_z_N", "torque_x_Nm", "torque_y_Nm", "torque_z_Nm",
    *(f"wrench_{name}" for name in (*_TIMES, "validity", "kind", "frame")),
)  # fmt: skip
_JOINTS: Final = tuple(f"joints_{name}" for name in (*_TIMES, "validity"))


def export_csv(paths: Sequence[Path], out: Path) -> list[Path]:
    """Write the logs into a new folder: the files themselves for one log, a subfolder each for several.

    Returns:
        The folders that hold a trial's files.

    Raises:
        LogError: A log cannot be read; nothing is written then.
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
    """The files' own names, numbered where two are the same."""
    names: list[str] = []
    for path in paths:
        name, number = path.stem, 1
        while name in names:
            number += 1
            name = f"{path.stem}-{number}"
        names.append(name)
    return names


def _write_log(log: TrialLog, folder: Path) -> None:
    records = list(log.records())
    joints = _most_joints([*records, *log.calls])
    each = {name: tuple(f"{name}_{i}_rad" for i in range(1, joints + 1)) for name in ("joint", "asked", "applied")}
    samples = (*_WRENCH, *each["joint"], *_JOINTS, *each["asked"], *each["applied"], "reason")
    ticks = ("tick", "time_ns", "deadline_ns", *samples, "counterfactual")
    _write(folder / "ticks.csv", ticks, (_row(record, ticks, each) for record in records))
    calls = ("tick", "port", "call", "time_ns", *samples, "error", "text")
    _write(folder / "calls.csv", calls, (_row(call, calls, each) for call in log.calls))
    earned = {
        entry.number: {"reinforcement": entry.reinforcement, "reinforcement_tick": entry.tick}
        for entry in log.reinforcements
    }
    decisions = (
        "number", "tick", "symbol", "state", "action", "source", "temperature", "reinforcement", "reinforcement_tick",
        "counterfactual",
    )  # fmt: skip
    _write(
        folder / "decisions.csv",
        decisions,
        (_plain(decision, decisions) | earned.get(decision.number, {}) for decision in log.decisions),
    )
    for name, kind, entries in (("events", EventEntry, log.events), ("recorder", LossEntry, log.losses)):
        columns = [field.name for field in dataclasses.fields(kind)]
        _write(folder / f"{name}.csv", columns, map(dataclasses.asdict, entries))
    (folder / "config.toml").write_text(log.start.config_toml, encoding="utf-8")
    _write_json(folder / "start.json", {"log": log.path, **_unfolded(log, "start", log.start)})
    if log.end is not None:
        _write_json(folder / "end.json", _unfolded(log, "end", log.end))


def _plain(entry: Any, columns: Sequence[str]) -> dict[str, Any]:
    return {name: getattr(entry, name) for name in columns if hasattr(entry, name)}


def _row(entry: TickRecord | CallEntry, columns: Sequence[str], each: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    """The columns that the entry has something for."""
    row = _plain(entry, columns)
    if (wrench := entry.wrench) is not None:
        marks = (wrench.validity.value, wrench.kind.value, wrench.frame)
        row |= zip(_WRENCH, (*wrench.force_N, *wrench.torque_Nm, *_times(wrench), *marks), strict=True)
    if (joints := entry.joints) is not None:
        row |= zip(each["joint"], joints.position_rad, strict=False)
        row |= zip(_JOINTS, (*_times(joints), joints.validity.value), strict=True)
    row |= zip(each["asked"], entry.asked_rad or (), strict=False)
    if (applied := entry.applied) is not None:
        row |= {"reason": applied.reason.value, **dict(zip(each["applied"], applied.position_rad, strict=False))}
    return row


def _times(sample: WrenchSample | JointSample) -> tuple[int, ...]:
    return sample.source_time_ns, sample.receive_time_ns, sample.sequence


def _most_joints(entries: Iterable[TickRecord | CallEntry]) -> int:
    vectors = (
        vector
        for entry in entries
        for vector in (
            entry.asked_rad,
            entry.joints and entry.joints.position_rad,
            entry.applied and entry.applied.position_rad,
        )
    )
    return max((len(vector) for vector in vectors if vector), default=0)


def _write(path: Path, columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        # The csv module writes floats by repr.
        writer.writerows(rows)


def _unfolded(log: TrialLog, message: str, record: Any) -> dict[str, Any]:
    """The record's fields; the JSON texts among them parsed, under their name without ``_json``."""
    fields = {}
    for name, value in dataclasses.asdict(record).items():
        if name == "config_toml":
            continue
        if name.endswith("_json"):
            fields[name.removesuffix("_json")] = json_in(log, f"{message}.{name}", value) if value else None
        else:
            fields[name] = value
    return fields


def _write_json(path: Path, value: dict[str, Any]) -> None:
    path.write_text(json.dumps(finite(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")
