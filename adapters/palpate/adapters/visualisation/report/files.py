"""Reads the files of result folders; an error is one line with the file's path."""

import csv
import io
import json
import os
import tomllib
from math import isfinite
from pathlib import Path
from typing import Any

from palpate.adapters.config import run_facts
from palpate.adapters.experiments import RunFolder, TrialRow
from palpate.core.errors import OutputError


def is_there(path: Path) -> bool:
    """Whether there is something of that name."""
    # Not Path.exists, which raises where it may not look.
    return os.path.exists(path)


def read_bytes(path: Path) -> bytes:
    """A whole file."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise OutputError(
            str(path), f"cannot be read ({error.strerror})", "mend that, or make the run again"
        ) from error


def read_text(path: Path) -> str:
    """A whole text file."""
    try:
        return read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise OutputError(str(path), f"is no text in UTF-8 ({error.reason})", "make the run again") from error


def read_json(path: Path) -> dict[str, Any]:
    """A JSON file that holds an object."""
    try:
        content = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise OutputError(str(path), f"is no whole JSON file ({error})", "make the run again") from error
    if not isinstance(content, dict):
        raise OutputError(str(path), "holds no JSON object", "make the run again")
    return content


def read_run_toml(folder: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """The settings of a run, and how it was called; both empty where there is no ``run.toml``."""
    path = folder / "run.toml"
    if not is_there(path):
        return {}, {}
    try:
        settings = tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as error:
        raise OutputError(str(path), f"is no TOML file ({error})", "make the run again") from error
    facts = run_facts(settings, path)
    return settings, facts


def read_trials(folder: Path) -> tuple[TrialRow, ...]:
    """The finished trials of a run."""
    path = folder / "trials.csv"
    if is_there(path):
        # A line that was cut short may still read as numbers, only as other ones.
        _require_whole_lines(path, read_bytes(path))
    rows = RunFolder(folder).read_trials()
    if any(row.marked is None for row in rows):
        raise OutputError(str(path), "has a line with too few columns", "mend it or begin a new run")
    if not all(isfinite(row.exploration_time_s) and isfinite(row.peak_force_N) for row in rows):
        raise OutputError(str(path), "has a time or a force that is not finite", "mend it or begin a new run")
    return tuple(rows)


def number(value: Any) -> float:
    """A finite number from a file."""
    found = float(value)
    if not isfinite(found):
        raise ValueError(f"{value} is not finite")
    return found


def read_table(path: Path, columns: tuple[str, ...]) -> list[dict[str, str]]:
    """The lines of a CSV file by column; further columns are kept."""
    text = read_text(path)
    _require_whole_lines(path, text.encode())
    reader = csv.DictReader(io.StringIO(text))
    missing = [name for name in columns if name not in (reader.fieldnames or ())]
    if missing:
        raise OutputError(str(path), f"has no column {missing[0]}", "make the run again")
    rows = list(reader)
    if any(None in row or None in row.values() for row in rows):
        raise OutputError(str(path), "has a line with too few or too many columns", "make the run again")
    return rows


def _require_whole_lines(path: Path, content: bytes) -> None:
    if content and not content.endswith(b"\n"):
        raise OutputError(str(path), "ends in the middle of a line", "mend it or begin a new run")
