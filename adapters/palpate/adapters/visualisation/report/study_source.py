"""What the folder of a study holds: cells, each a run with one seed, one policy and one choice of settings."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from palpate.adapters.experiments.study import CELL_FILE, FORMAT, UNFINISHED, Study
from palpate.adapters.visualisation.report.files import is_there, read_json
from palpate.adapters.visualisation.report.run_source import RunSource
from palpate.core.errors import ConfigurationError, OutputError, one_line

_NUMBERED: Final = re.compile(r"(\.[0-9a-f]+)?\.unfinished$")
"""A cell in the making has a folder of another name, and another one for every attempt."""

Setting = tuple[tuple[str, str], ...]
"""Names and values of the swept fields, values as texts."""


@dataclass(frozen=True)
class ReportedCell:
    """A finished cell."""

    name: str
    fields: Mapping[str, Any]
    policy: str
    seed: int
    run: RunSource

    @property
    def setting(self) -> Setting:
        """Its fields in a form that can be compared."""
        return tuple((name, shown_value(value)) for name, value in self.fields.items())


@dataclass(frozen=True)
class StudySource:
    """The content of a study's folder.

    Attributes:
        cells: The finished cells, ordered by their fields, policies and seeds.
        problem: Why ``study.toml`` does not give how many cells there should be; empty if it does.
    """

    path: Path
    cells: tuple[ReportedCell, ...]
    begun: tuple[str, ...]
    unfinished: int
    problem: str = ""

    @classmethod
    def read(cls, path: Path) -> StudySource:
        """Read a folder."""
        folder = path / "cells"
        names = sorted(os.listdir(folder)) if os.path.isdir(folder) else []
        names = [name for name in names if not name.startswith(".") and os.path.isdir(folder / name)]
        if not names:
            raise OutputError(str(path), "is a study without a cell", "let palpate study run first")
        finished = [name for name in names if is_there(folder / name / CELL_FILE) and not name.endswith(UNFINISHED)]
        begun = dict.fromkeys(_NUMBERED.sub("", name) for name in names if name not in finished)
        begun = {name: None for name in begun if name not in finished}
        asked, problem = _asked(path / "study.toml")
        unfinished = max(len(begun), asked - len(finished))
        if not finished:
            reason = f"is a study with {unfinished} cell{'s' * (unfinished > 1)}, none of them finished"
            raise OutputError(str(path), reason, "let palpate study go on")
        cells = _with_short_policies(_with_all_fields([_cell(folder / name) for name in finished]))
        return cls(path, tuple(sorted(cells, key=_order)), tuple(begun), unfinished, problem)

    @property
    def swept(self) -> dict[str, list[Any]]:
        """The fields that differ between cells, and their values in rising order."""
        fields = list(self.cells[0].fields)
        values = {field: _distinct([cell.fields[field] for cell in self.cells]) for field in fields}
        return {field: found for field, found in values.items() if len(found) > 1}

    @property
    def policies(self) -> list[str]:
        """The policies, those that learn first."""
        learning = {cell.policy for cell in self.cells if cell.run.learns}
        return sorted({cell.policy for cell in self.cells}, key=lambda name: (name not in learning, name))

    @property
    def groups(self) -> dict[tuple[Setting, str], list[ReportedCell]]:
        """Cells that differ in nothing but their seed, by setting and policy."""
        found: dict[tuple[Setting, str], list[ReportedCell]] = {}
        for cell in self.cells:
            found.setdefault((cell.setting, cell.policy), []).append(cell)
        return found


def shown_value(value: Any) -> str:
    """A field's value for people."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.6g}"
    return ", ".join(map(shown_value, value)) if isinstance(value, list) else str(value)


def shown_setting(setting: Setting) -> str:
    """A choice of fields for people; the defaults where nothing is swept."""
    return ", ".join(f"{name} = {value}" for name, value in setting) or "all settings as in study.toml"


def is_number(value: Any) -> bool:
    """Whether a value has a place on an axis."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _asked(path: Path) -> tuple[int, str]:
    """How many cells the study has, or why that is unknown."""
    if not is_there(path):
        return 0, f"there is no {path.name}"
    try:
        return Study.read(path).count, ""
    except ConfigurationError as error:
        # What is finished can be reported all the same.
        return 0, one_line(error)


def _cell(folder: Path) -> ReportedCell:
    path = folder / CELL_FILE
    content = read_json(path)
    if content.get("format") != FORMAT:
        raise OutputError(str(path), f"has format {content.get('format')!r}, not {FORMAT}", "another palpate wrote it")
    fields, policy, seed = content.get("fields"), content.get("policy"), content.get("seed")
    if not isinstance(fields, dict) or not isinstance(policy, str) or not isinstance(seed, int):
        raise OutputError(str(path), "lacks fields, policy or seed", "remove it, and let palpate study make it again")
    for name in ("trials.csv", "summary.json"):
        if not is_there(folder / name):
            raise OutputError(
                str(folder), f"says that it is finished, but has no {name}",
                "remove the cell's folder, and let palpate study make it again",
            )  # fmt: skip
    return ReportedCell(folder.name, fields, policy, seed, RunSource.read(folder))


def _with_all_fields(cells: list[ReportedCell]) -> list[ReportedCell]:
    """Cells that name the same fields: one that leaves a field as it is has the value that its run really had."""
    names = sorted({name for cell in cells for name in cell.fields})
    return [
        replace(
            cell, fields={name: cell.fields[name] if name in cell.fields else _in_run(cell, name) for name in names}
        )
        for cell in cells
    ]


def _in_run(cell: ReportedCell, name: str) -> Any:
    value: Any = cell.run.settings
    for word in name.split("."):
        value = value.get(word) if isinstance(value, dict) else None
    return "default" if value is None else value


def _with_short_policies(cells: list[ReportedCell]) -> list[ReportedCell]:
    """Cells that call a policy file by the folder of the run that made it, unless two would have one name."""
    paths = {cell.policy: Path(cell.policy) for cell in cells}
    short = {name: path.parent.name or path.stem if path.suffix == ".json" else name for name, path in paths.items()}
    if len(set(short.values())) < len(short):
        return cells
    return [replace(cell, policy=short[cell.policy]) for cell in cells]


def _order(cell: ReportedCell) -> tuple[Any, ...]:
    return (*(_rank(value) for value in cell.fields.values()), cell.policy, cell.seed, cell.name)


def _distinct(values: list[Any]) -> list[Any]:
    found = {shown_value(value): value for value in values}
    return sorted(found.values(), key=_rank)


def _rank(value: Any) -> tuple[bool, float, str]:
    """Numbers by size, before anything else by name."""
    return (False, float(value), "") if is_number(value) else (True, 0.0, shown_value(value))
