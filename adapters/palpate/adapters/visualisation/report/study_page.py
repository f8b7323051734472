"""The page of a study: figures, success and time against each swept setting, and learning curves."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.adapters.experiments import TrialRow, mean_with_interval, shown_interval
from palpate.adapters.experiments.study import CELL_FILE, FORMAT, UNFINISHED, Study
from palpate.adapters.visualisation.report.files import read_json
from palpate.adapters.visualisation.report.page import Page, PageSection, PageTable, Picture
from palpate.adapters.visualisation.report.pictures import learning_picture, mean_s, sweep_picture
from palpate.adapters.visualisation.report.run_page import HEAD, RunSource, figures_row, settings_section
from palpate.core.errors import ConfigurationError, OutputError

Setting = tuple[tuple[str, str], ...]
"""Names and values of the swept settings."""


@dataclass(frozen=True)
class ReportedCell:
    """A finished run of the study: one policy, one seed and one choice of settings."""

    fields: Mapping[str, Any]
    policy: str
    seed: int
    run: RunSource

    @property
    def setting(self) -> Setting:
        """Its settings in a form that can be compared."""
        return tuple((name, _shown(value)) for name, value in self.fields.items())


def study_page(folder: Path) -> Page:
    """Put together the page of a study."""
    names = sorted(os.listdir(folder / "cells")) if os.path.isdir(folder / "cells") else []
    paths = [folder / "cells" / name for name in names if not name.endswith(UNFINISHED)]
    cells = [_cell(path) for path in paths if (path / CELL_FILE).exists()]
    if not cells:
        raise OutputError(str(folder), "is a study without a finished cell", "let palpate study run first")
    cells.sort(key=lambda cell: ([_rank(value) for value in cell.fields.values()], cell.policy, cell.seed))
    groups: dict[tuple[Setting, str], list[ReportedCell]] = {}
    for cell in cells:
        groups.setdefault((cell.setting, cell.policy), []).append(cell)
    fields = dict.fromkeys(name for cell in cells for name in cell.fields)
    swept = {name: _distinct(cell.fields.get(name) for cell in cells) for name in fields}
    swept = {name: values for name, values in swept.items() if len(values) > 1}
    sections = (
        PageSection("In figures", tables=(_figures(groups),)),
        PageSection("Against the swept settings", pictures=tuple(_sweep(name, swept[name], cells) for name in swept)),
        PageSection("Learning curves", pictures=tuple(_curves(groups))),
        settings_section(folder / "study.toml"),
    )
    facts = [("Cells", str(len(cells))), ("Where", "simulator"), ("Date", max(cell.run.date for cell in cells))]
    facts += [(f"Swept: {name}", ", ".join(values)) for name, values in swept.items()]
    facts += [("Policies", ", ".join(_distinct(cell.policy for cell in cells)))]
    facts += [("Seeds", ", ".join(_distinct(cell.seed for cell in cells)))]
    facts += [("Trials in all", str(sum(len(cell.run.rows) for cell in cells)))]
    return Page(folder.resolve().name, "study", tuple(facts), sections, _notices(folder / "study.toml", len(cells)))


def _notices(path: Path, finished: int) -> tuple[str, ...]:
    try:
        asked = Study.read(path).count
    except ConfigurationError as error:
        return (f"The number of cells is unknown: {error}",)
    return (f"This study is unfinished: {asked - finished} of {asked} cells are missing.",) if asked > finished else ()


def _figures(groups: Mapping[tuple[Setting, str], Sequence[ReportedCell]]) -> PageTable:
    rows = []
    for (setting, policy), cells in groups.items():
        name = ", ".join([policy, *(f"{field} = {value}" for field, value in setting)])
        _, trials, success, _, *others = figures_row(name, _late(cells))
        mean = shown_interval(*mean_with_interval([mean_s(cell.run.late) for cell in cells]))
        rows.append((name, str(len(cells)), trials, success, mean, *others))
    caption = (
        "Brackets: 95 % intervals, exact of success, Student's t over seeds of the mean, by order statistics of"
        " medians. Of policies that learn, the last trials count"
    )
    return PageTable(caption, (HEAD[0], "seeds", *HEAD[1:]), tuple(rows))


def _sweep(field: str, values: Sequence[str], cells: Sequence[ReportedCell]) -> Picture:
    lines: dict[str, dict[str, list[Sequence[TrialRow]]]] = {}
    for cell in cells:
        value = _shown(cell.fields.get(field))
        lines.setdefault(cell.policy, {}).setdefault(value, []).append(cell.run.late)
    return sweep_picture(field, values, lines)


def _curves(groups: Mapping[tuple[Setting, str], Sequence[ReportedCell]]) -> list[Picture]:
    """Return a picture for each choice of settings: learners as curves, other policies as lines."""
    pictures = []
    for setting in list(dict.fromkeys(setting for setting, _ in groups))[:12]:
        of_setting = {policy: cells for (own, policy), cells in groups.items() if own == setting}
        curves = {name: [cell.run.rows for cell in own] for name, own in of_setting.items() if own[0].run.learns}
        levels = {name: _late(own) for name, own in of_setting.items() if name not in curves}
        if curves:
            title = ", ".join(f"{name} = {value}" for name, value in setting)
            pictures.append(learning_picture(curves, levels, f"{title}. " if title else ""))
    return pictures


def _late(cells: Sequence[ReportedCell]) -> list[TrialRow]:
    return [row for cell in cells for row in cell.run.late]


def _cell(folder: Path) -> ReportedCell:
    path = folder / CELL_FILE
    content = read_json(path)
    if content.get("format") != FORMAT:
        raise OutputError(str(path), f"has format {content.get('format')!r}", f"this palpate reads {FORMAT!r}")
    fields, policy, seed = content.get("fields"), content.get("policy"), content.get("seed")
    if not isinstance(fields, dict) or not isinstance(policy, str) or not isinstance(seed, int):
        raise OutputError(str(path), "lacks fields, policy or seed", "remove the cell, and run palpate study again")
    return ReportedCell(fields, policy, seed, RunSource.read(folder))


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return ", ".join(map(_shown, value)) if isinstance(value, list) else str(value)


def _distinct(values: Any) -> list[str]:
    return [_shown(value) for value in sorted({_shown(value): value for value in values}.values(), key=_rank)]


def _rank(value: Any) -> tuple[bool, float, str]:
    """Sort numbers by size, before anything else by name."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return (False, float(value), "") if number else (True, 0.0, _shown(value))
