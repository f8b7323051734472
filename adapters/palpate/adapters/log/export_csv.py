"""A log as CSV and JSON files, with every bit of every number.

Floats are written by ``repr``, so that they read back exactly; what was not there is an empty cell.
"""

import csv
import dataclasses
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from palpate.adapters.log.file import finite, json_in
from palpate.adapters.log.reader import TrialLog, read_log
from palpate.adapters.log.records import CallEntry, EventEntry, LossEntry
from palpate.adapters.log.tick_layout import TickRecord
from palpate.core.ports import AppliedCommand, JointSample, JointVector, WrenchSample, new_folder

_WRENCH: Final = (
    "force_x_N", "force_y_N", "force_z_N", "torque_x_Nm", "torque_y_Nm", "torque_z_Nm",
    "wrench_source_time_ns", "wrench_receive_time_ns", "wrench_sequence", "wrench_validity", "wrench_kind",
    "wrench_frame",
)  # fmt: skip
_JOINTS_MORE: Final = ("joints_source_time_ns", "joints_receive_time_ns", "joints_sequence", "joints_validity")


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
    _write(
        folder / "ticks.csv",
        ("tick", "time_ns", "deadline_ns", *_sample_columns(joints), "counterfactual"),
        (
            (r.tick, r.time_ns, r.deadline_ns, *_samples(r, joints), r.counterfactual)
            for r in records
        ),
    )  # fmt: skip
    _write(
        folder / "calls.csv",
        ("tick", "port", "call", "time_ns", *_sample_columns(joints), "error", "text"),
        ((c.tick, c.port, c.call, c.time_ns, *_samples(c, joints), c.error, c.text) for c in log.calls),
    )
    earned = {entry.number: entry for entry in log.reinforcements}
    _write(
        folder / "decisions.csv",
        ("number", "tick", "symbol", "state", "action", "source", "temperature", "reinforcement",
         "reinforcement_tick", "counterfactual"),
        (
            (d.number, d.tick, d.symbol, d.state, d.action, d.source, d.temperature,
             *((earned[d.number].reinforcement, earned[d.number].tick) if d.number in earned else (None, None)),
             d.counterfactual)
            for d in log.decisions
        ),
    )  # fmt: skip
    for name, kind, entries in (("events", EventEntry, log.events), ("recorder", LossEntry, log.losses)):
        columns = [field.name for field in dataclasses.fields(kind)]
        _write(folder / f"{name}.csv", columns, map(dataclasses.astuple, entries))
    (folder / "config.toml").write_text(log.start.config_toml, encoding="utf-8")
    _write_json(folder / "start.json", {"log": log.path, **_unfolded(log, "start", log.start)})
    if log.end is not None:
        _write_json(folder / "end.json", _unfolded(log, "end", log.end))


def _sample_columns(joints: int) -> tuple[str, ...]:
    def each(name: str) -> tuple[str, ...]:
        return tuple(f"{name}_{i}_rad" for i in range(1, joints + 1))

    return (*_WRENCH, *each("joint"), *_JOINTS_MORE, *each("asked"), *each("applied"), "reason")


def _samples(entry: TickRecord | CallEntry, joints: int) -> tuple[Any, ...]:
    return (
        *_wrench_cells(entry.wrench),
        *_joint_cells(entry.joints, joints),
        *_filled(entry.asked_rad, joints),
        *_applied_cells(entry.applied, joints),
    )


def _wrench_cells(sample: WrenchSample | None) -> tuple[Any, ...]:
    if sample is None:
        return (None,) * len(_WRENCH)
    return (
        *sample.force_N, *sample.torque_Nm, sample.source_time_ns, sample.receive_time_ns, sample.sequence,
        sample.validity.value, sample.kind.value, sample.frame,
    )  # fmt: skip


def _joint_cells(sample: JointSample | None, joints: int) -> tuple[Any, ...]:
    if sample is None:
        return (None,) * (joints + len(_JOINTS_MORE))
    return (
        *_filled(sample.position_rad, joints), sample.source_time_ns, sample.receive_time_ns, sample.sequence,
        sample.validity.value,
    )  # fmt: skip


def _applied_cells(applied: AppliedCommand | None, joints: int) -> tuple[Any, ...]:
    if applied is None:
        return (None,) * (joints + 1)
    return (*_filled(applied.position_rad, joints), applied.reason.value)


def _filled(values: JointVector | None, joints: int) -> tuple[float | None, ...]:
    have = values or ()
    return (*have, *((None,) * (joints - len(have))))


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


def _write(path: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
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
