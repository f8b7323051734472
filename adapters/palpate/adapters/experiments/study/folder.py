"""A study's folder: what was asked, a folder for every cell, and ``summary.csv`` of all."""

import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from palpate.adapters.config import read_toml
from palpate.adapters.experiments.policies import first_difference
from palpate.adapters.experiments.results import RunFolder
from palpate.adapters.experiments.study.cell import CELL_FILE, StudyCell
from palpate.adapters.experiments.study.document import Study
from palpate.adapters.experiments.study.fields import plain, setting
from palpate.adapters.experiments.study.run_cell import UNFINISHED
from palpate.adapters.experiments.writer_lock import LOCK, only_writer
from palpate.adapters.log import csv_text, made_with
from palpate.core.errors import ConfigurationError, OutputError
from palpate.core.ports import json_of_file

_IN_OTHER_COLUMNS: Final = ("scenario", "arm", "seed", "policy", "finished")
"""Entries of a summary that the cell's own columns, or the line itself, hold already."""
_COUNTS: Final = ("outcomes", "trips", "marked_why")


def table_of(study: Study, rows: Sequence[tuple[StudyCell, Mapping[str, Any]]]) -> str:
    """The table as CSV."""
    fields = list(dict.fromkeys(name for one in (*study.listed, study.grid) for name in one))
    flat = [dict(_flat(figures)) for _, figures in rows]
    columns = _columns(flat)
    lines: list[list[Any]] = [["cell", *fields, "policy", "seed", *(".".join(name) for name in columns)]]
    for (cell, _), values in zip(rows, flat, strict=True):
        # A cell of a list may leave settings as they are that others name.
        left = {name for name in fields if name not in cell.fields}
        config = study.config(cell.fields) if left else None
        known = [setting(config, name) if name in left else cell.fields[name] for name in fields]
        # An outcome that a cell does not name never came about; other figures it may not have.
        figures = (values.get(name, 0 if name[0] in _COUNTS else "") for name in columns)
        lines.append([cell.name, *map(_word, known), cell.policy, cell.seed, *figures])
    return csv_text(lines)


def _columns(rows: Sequence[Mapping[tuple[str, ...], Any]]) -> list[tuple[str, ...]]:
    """All columns of all rows, those of one table beside each other."""
    tables: dict[str, dict[tuple[str, ...], None]] = {}
    for row in rows:
        for name in row:
            tables.setdefault(name[0], {})[name] = None
    return [name for table in tables.values() for name in table]


def _flat(figures: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], Any]]:
    for name, value in figures.items():
        if name in _IN_OTHER_COLUMNS:
            continue
        if isinstance(value, Mapping):
            yield from (((name, inner), figure) for inner, figure in value.items())
        elif isinstance(value, list) and len(value) == 2:
            low, high = value
            yield from (((f"{name}_low",), low), ((f"{name}_high",), high))
        else:
            yield (name,), value


def _word(value: Any) -> Any:
    return json.dumps(value, ensure_ascii=False) if isinstance(value, (list, dict)) else value


STUDY_FILE: Final = "study.toml"
_TABLE: Final = "summary.csv"
CELLS: Final = "cells"
_ELSEWHERE: Final = "name another folder with --out"


class StudyFolder:
    """The folder of one study."""

    def __init__(self, path: Path) -> None:
        self.path, self.cells = path, path / CELLS

    def count(self) -> int:
        """About how many cells are finished."""
        try:
            return sum(not name.endswith(UNFINISHED) for name in os.listdir(self.cells))
        except OSError:
            return 0

    def require_fits(self, study: Study, cells: Sequence[StudyCell], files: Mapping[str, str]) -> None:
        """Make sure that the folder is free, or holds this study, made of files with these digests, or a smaller one.

        Raises:
            OutputError: It holds something else, or cells that the study does not have.
            ConfigurationError: The study that it holds was made with other settings, files or versions.
        """
        if not os.path.lexists(self.path):
            return
        names = [name for name in os.listdir(self.path) if name != LOCK]
        if STUDY_FILE not in names:
            if names:
                raise OutputError(str(self.path), f"holds something already, and no study ({names[0]})", _ELSEWHERE)
            return
        path = self.path / STUDY_FILE
        try:
            held, table = Study.read(path), read_toml(path)
        except ConfigurationError as error:
            raise OutputError(str(path), f"cannot be read ({error})", f"mend it or {_ELSEWHERE}") from error
        self._require_same(held, study)
        _require_equal("versions", table.get("versions", {}), made_with(), self.path)
        _require_equal("files", table.get("files", {}), files, self.path)
        asked = {cell.name for cell in cells}
        missing = next((cell for cell in held.cells() if cell.name not in asked), None)
        if missing is not None:
            problem = f"holds a study with cells that are not asked for ({missing})"
            raise OutputError(str(self.path), problem, f"a study may grow, not shrink: add them, or {_ELSEWHERE}")

    def _require_same(self, held: Study, study: Study) -> None:
        if held.trials != study.trials:
            raise ConfigurationError("study.trials", study.trials, f"{held.trials}, {_as_held(self.path)}")
        # With settings of a cell: without any, the base need not make sense.
        fields = next(held.settings())
        asked, begun = (plain(asdict(one.config(fields))) for one in (study, held))
        if asked != begun:
            name, value, before = first_difference(asked, begun)
            raise ConfigurationError(f"base.{name}", value, f"{before!r}, {_as_held(self.path)}")

    @contextmanager
    def opened(self, study: Study, files: Mapping[str, str]) -> Iterator[None]:
        """Make the folder, write down what is asked, and keep others out.

        Raises:
            OutputError: It cannot be made, or another study is at work in it.
        """
        RunFolder(self.cells).create()
        with only_writer(self.path):
            RunFolder(self.path).write(STUDY_FILE, study.text(made_with(), files))
            yield

    def finished(self, cells: Sequence[StudyCell]) -> set[str]:
        """Names of the cells that are finished.

        Raises:
            OutputError: A folder holds another cell than the one of its name.
        """
        try:
            there = set(os.listdir(self.cells))
        except OSError:
            return set()
        return {cell.name for cell in cells if cell.name in there and self._is_whole(cell)}

    def _is_whole(self, cell: StudyCell) -> bool:
        path = self.cells / cell.name
        found = _json(path / CELL_FILE)
        if found is not None and found != cell.document():
            raise OutputError(str(path), f"is not the cell {cell}", f"take it away, or {_ELSEWHERE}")
        return found is not None and _json(path / "summary.json") is not None

    def clear(self, cells: Sequence[StudyCell], finished: set[str]) -> list[str]:
        """Take away what was begun and not finished; returns the names of those cells."""
        asked = {cell.name for cell in cells}
        half: list[str] = []
        for name in sorted(os.listdir(self.cells)):
            if name.endswith(UNFINISHED) or (name in asked and name not in finished):
                shutil.rmtree(self.cells / name, ignore_errors=True)
                cell = name.removesuffix(UNFINISHED).rpartition(".")[0] if name.endswith(UNFINISHED) else name
                if cell not in half and cell not in finished:
                    half.append(cell)
        return half

    def write_table(self, study: Study, cells: Sequence[StudyCell]) -> int:
        """Write ``summary.csv``, a line for each finished cell in the order of the study; returns their number."""
        finished = self.finished(cells)
        done = [cell for cell in cells if cell.name in finished]
        rows = [(cell, _json(self.cells / cell.name / "summary.json") or {}) for cell in done]
        RunFolder(self.path).write(_TABLE, table_of(study, rows))
        return len(rows)


def _json(path: Path) -> dict[str, Any] | None:
    """The object in a JSON file; None if that is not whole."""
    try:
        found = json_of_file(path)
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def _require_equal(what: str, held: Mapping[str, str], own: Mapping[str, str], path: Path) -> None:
    for name in held:
        # A study that grows may use more files than before.
        if name in own and own[name] != held[name]:
            value, before = own[name], held[name]
            if what == "files":
                raise ConfigurationError("file", name, f"the same content as {_as_held(path)}")
            raise ConfigurationError(f"{what}.{name}", value, f"{before}, {_as_held(path)}")


def _as_held(path: Path) -> str:
    return f"as in the study in {path}; or {_ELSEWHERE}"
