"""Reads the files of result folders; an error is one line with the file's path."""

import json
from math import isfinite
from pathlib import Path
from typing import Any

from palpate.adapters import files
from palpate.adapters.config import read_toml, run_facts
from palpate.adapters.experiments import RunFolder, TrialRow
from palpate.core.errors import OutputError


def read_text(path: Path) -> str:
    """Return a whole text file; nothing where there is none."""
    return files.read_text(path, "file") if path.exists() else ""


def read_json(path: Path) -> dict[str, Any]:
    """Return the object of a JSON file; an empty one where there is no file."""
    try:
        content = json.loads(read_text(path) or "{}")
    except (ValueError, RecursionError) as error:
        raise OutputError(str(path), f"is no JSON file ({error})", "fix the file or rerun") from error
    if not isinstance(content, dict):
        raise OutputError(str(path), "holds no JSON object", "fix the file or rerun")
    return content


def read_run_toml(folder: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the settings of a run, and the facts of its call; both empty where there is no ``run.toml``."""
    path = folder / "run.toml"
    settings = read_toml(path) if path.exists() else {}
    return settings, run_facts(settings, path)


def read_trials(folder: Path) -> tuple[TrialRow, ...]:
    """Return the finished trials of a run."""
    path = folder / "trials.csv"
    text = read_text(path)
    # A line that was cut short may still read as numbers.
    if text and not text.endswith("\n"):
        raise OutputError(str(path), "ends in the middle of a line", "fix the file or rerun")
    rows = RunFolder(folder).read_trials()
    if not all(isfinite(row.exploration_time_s) and isfinite(row.peak_force_N) for row in rows):
        raise OutputError(str(path), "has a time or a force that is not finite", "fix the file or rerun")
    return tuple(rows)
