"""A study's folder: the study file, a folder for every finished condition, and ``summary.csv``."""

import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import tomlkit

from palpate.adapters.experiments.results import LOCK, RunFolder, only_writer
from palpate.adapters.experiments.study.document import SUMMARY, Condition, Study, setting_of
from palpate.adapters.files import whole_text
from palpate.adapters.log import csv_text
from palpate.core.errors import OutputError

STUDY_FILE: Final = "study.toml"
_ELSEWHERE: Final = "name another folder with --out"
_IN_OTHER_COLUMNS: Final = ("scenario", "arm", "seed", "policy", "finished")
"""Entries in a summary that are already in other columns."""
_COUNTS: Final = ("outcomes", "trips", "flagged_reasons")
"""Tables in a summary in which counts of zero are omitted."""


class StudyFolder:
    """A study's folder."""

    def __init__(self, path: Path) -> None:
        self.path, self.conditions = path, path.absolute() / "conditions"

    @contextmanager
    def writing(self, file: Path, job: str, conditions: Sequence[Condition]) -> Iterator[list[Condition]]:
        """Create and lock the folder, write the study file, and yield the unfinished conditions.

        Raises:
            OutputError: The folder contains something else, or another process is writing to it.
        """
        names = [name for name in os.listdir(self.path) if name != LOCK] if os.path.lexists(self.path) else []
        if names and STUDY_FILE not in names:
            raise OutputError(str(self.path), f"holds something already, and no study ({names[0]})", _ELSEWHERE)
        self.conditions.mkdir(parents=True, exist_ok=True)
        with only_writer(self.path):
            missing = [each for each in conditions if not self._is_finished(each)]
            document = tomlkit.parse(whole_text(file).read())
            if job:
                document["study"]["job"] = job
            RunFolder(self.path).write(STUDY_FILE, tomlkit.dumps(document))
            self._clear()
            try:
                yield missing
            finally:
                # Remove the folders of dead and interrupted workers.
                self._clear()

    def write_table(self, study: Study, conditions: Sequence[Condition]) -> int:
        """Write ``summary.csv``, with a line per finished condition in study order; return the number of lines."""
        rows = []
        for condition in conditions:
            if summary := RunFolder(self.conditions / condition.name).summary():
                rows.append((condition, dict(_flat(summary))))
        RunFolder(self.path).write("summary.csv", _table(study.fields, rows))
        return len(rows)

    def _is_finished(self, condition: Condition) -> bool:
        path = self.conditions / condition.name
        if not (path / SUMMARY).exists():
            return False
        before, now = (path / "run.toml").read_text(encoding="utf-8"), condition.record()
        if before != now:
            line = next(new for old, new in zip(before.splitlines(), now.splitlines(), strict=False) if old != new)
            raise OutputError(str(path), f"was run with other settings or versions, not {line}", _ELSEWHERE)
        return True

    def _clear(self) -> None:
        for path in self.conditions.glob(".*.part"):
            shutil.rmtree(path, ignore_errors=True)


def _table(fields: Sequence[str], rows: Sequence[tuple[Condition, Mapping[tuple[str, ...], Any]]]) -> str:
    names = list(dict.fromkeys(name for _, values in rows for name in values))
    tables = list(dict.fromkeys(name[0] for name in names))
    columns = sorted(names, key=lambda name: tables.index(name[0]))
    lines: list[list[Any]] = [["condition", *fields, "policy", "seed", *(".".join(name) for name in columns)]]
    for condition, values in rows:
        known = (setting_of(condition.config, name) for name in fields)
        figures = (values.get(name, 0 if name[0] in _COUNTS else "") for name in columns)
        lines.append([condition.name, *map(_word, known), condition.policy, condition.config.seed, *figures])
    return csv_text(lines)


def _flat(figures: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], Any]]:
    for name, value in figures.items():
        if name in _IN_OTHER_COLUMNS:
            continue
        if isinstance(value, Mapping):
            yield from (((name, inner), figure) for inner, figure in value.items())
        elif isinstance(value, list) and len(value) == 2:
            yield from zip(((f"{name}_low",), (f"{name}_high",)), value, strict=True)
        else:
            yield (name,), value


def _word(value: Any) -> Any:
    return json.dumps(value, ensure_ascii=False) if isinstance(value, (list, Mapping)) else value
