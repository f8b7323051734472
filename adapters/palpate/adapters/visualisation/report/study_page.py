"""The page of a study: curves with bands, success and time against what was swept, comparators beside."""

from collections.abc import Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any, Final

from palpate.adapters.experiments import exact_interval, mean_with_interval, shown_interval, window_of
from palpate.adapters.visualisation.report.automaton_section import automaton_section, machine_in
from palpate.adapters.visualisation.report.learning_pictures import ReferenceLevel, learning_picture, means_of
from palpate.adapters.visualisation.report.logs import logs_in
from palpate.adapters.visualisation.report.page import (
    Cell,
    Page,
    PageSection,
    PageTable,
    Picture,
    counted,
    listed,
    share,
)
from palpate.adapters.visualisation.report.policy_pictures import arrows_pictures, q_picture
from palpate.adapters.visualisation.report.run_page import log_sections, settings_section, summary_cells
from palpate.adapters.visualisation.report.run_source import curve_of
from palpate.adapters.visualisation.report.study_source import (
    ReportedCell,
    Setting,
    StudySource,
    is_number,
    shown_setting,
    shown_value,
)
from palpate.adapters.visualisation.report.sweep_pictures import Point, SweepSeries, sweep_picture
from palpate.core.automata import Machine

MOST_SETTINGS: Final = 12
"""Choices of settings with pictures of their own; all are in the tables."""
_MOST_LINES: Final = 8
_MOST_FORCES: Final = 4
_MOST_AUTOMATA: Final = 4


def study_page(folder: Path, title: str, *, logs: bool) -> Page:
    """Put together the page of a study."""
    study = StudySource.read(folder)
    settings = list(dict.fromkeys(cell.setting for cell in study.cells))
    sections = [_sweep(study), _figures(study), _curves(study, settings[:MOST_SETTINGS])]
    sections += _policies(study, settings[:MOST_SETTINGS])
    if logs:
        sections += _logs(study)
    sections.append(settings_section(folder / "study.toml"))
    return Page(
        title=title,
        kind="a study",
        facts=_facts(study),
        notices=_notices(study, settings),
        sections=tuple(sections),
        summary=tuple(_summary(cells) for cells in study.groups.values()),
    )


def _facts(study: StudySource) -> tuple[tuple[str, str], ...]:
    facts = [("Cells", f"{len(study.cells)} finished of {len(study.cells) + study.unfinished}")]
    facts += [(f"Swept: {name}", listed([shown_value(v) for v in values], 12)) for name, values in study.swept.items()]
    facts.append(("Policies", listed(study.policies, 12)))
    seeds = sorted({cell.seed for cell in study.cells})
    facts.append(("Seeds", listed([str(seed) for seed in seeds], 12)))
    facts.append(("Trials in all", str(sum(len(cell.run.rows) for cell in study.cells))))
    return tuple(facts)


def _notices(study: StudySource, settings: list[Setting]) -> tuple[str, ...]:
    notices = []
    if study.unfinished:
        begun = f" Begun: {listed(study.begun)}." if study.begun else ""
        notices.append(
            f"This study is unfinished: {study.unfinished} of {study.unfinished + len(study.cells)} cells are missing"
            f" here.{begun}"
        )
    if study.problem:
        notices.append(f"How many cells there should be is not known: {study.problem}")
    short = [cell.name for cell in study.cells if cell.run.missing]
    if short:
        notices.append(f"{counted(len(short), 'cell')} with fewer trials than asked for: {listed(short)}.")
    if len(settings) > MOST_SETTINGS:
        notices.append(
            f"Of {len(settings)} choices of settings the first {MOST_SETTINGS} have learning curves and policies drawn."
        )
    return tuple(notices)


def _sweep(study: StudySource) -> PageSection:
    """A picture for every swept field; a line for each policy and each choice of the other fields."""
    pictures, text = [], []
    for field, values in study.swept.items():
        lines = _lines(study, field, apart=True)
        if len(lines) > _MOST_LINES:
            lines = _lines(study, field, apart=False)
            text.append(f"In the picture of {field} all values of the other settings are taken together.")
        pictures.append(sweep_picture(field, values, lines))
    return PageSection("Against the swept settings", tuple(text), pictures=tuple(pictures))


def _lines(study: StudySource, field: str, *, apart: bool) -> list[SweepSeries]:
    others = [name for name in study.swept if name != field]
    found: dict[str, dict[str, list[ReportedCell]]] = {}
    for policy in study.policies:
        for cell in (c for c in study.cells if c.policy == policy):
            held = [f"{name} = {shown_value(cell.fields[name])}" for name in others] if apart else []
            label = ", ".join([policy, *held])
            found.setdefault(label, {}).setdefault(shown_value(cell.fields[field]), []).append(cell)
    return [
        SweepSeries(label, tuple(_point(cells[0].fields[field], cells) for cells in points.values()))
        for label, points in found.items()
    ]


def _point(value: Any, cells: list[ReportedCell]) -> Point:
    late = [row for cell in cells for row in cell.run.late]
    return Point(value, tuple(_mean_s(cell) for cell in cells), sum(row.success for row in late), len(late))


def _mean_s(cell: ReportedCell) -> float:
    late = cell.run.late
    return sum(row.exploration_time_s for row in late) / len(late)


def _figures(study: StudySource) -> PageSection:
    swept = list(study.swept)
    rows = []
    for cells in study.groups.values():
        figures = _summary(cells)
        fields = [shown_value(cells[0].fields[name]) for name in swept]
        mean, low, high = mean_with_interval([_mean_s(cell) for cell in cells], _limit_s(cells))
        time = shown_interval(mean, low, high)
        success = [share(float(figures[name] or 0.0)) for name in ("success", "success_low", "success_high")]
        rows.append(
            (
                ", ".join([cells[0].policy, *(f"{name} = {v}" for name, v in zip(swept, fields, strict=True))]),
                str(len(cells)), f"{success[0]} [{success[1]}, {success[2]}]", time, f"{figures['median_s']:.2f}",
                f"{figures['peak_force_N']:.1f}",
            )
        )  # fmt: skip
    head = ("policy and settings", "seeds", "success", "mean [s]", "median [s]", "peak force [N]")
    caption = (
        "Brackets: 95 % intervals, exact of success over all trials, Student's t of the mean over seeds. Of policies"
        " that learn, the last trials count; the peak force is that of all trials"
    )
    return PageSection("In figures", tables=(PageTable(caption, head, tuple(rows)),))


def _curves(study: StudySource, settings: list[Setting]) -> PageSection:
    """A picture for each choice of settings: policies that learn as curves, the others as levels."""
    groups = study.groups
    pictures = []
    highest = _highest(study)
    for number, setting in enumerate(settings, 1):
        curves, levels = [], []
        for policy in study.policies:
            cells = groups.get((setting, policy), [])
            learning = [cell for cell in cells if cell.run.learns]
            if learning:
                curves.append(curve_of(policy, [cell.run.rows for cell in learning]))
            rows = [row for cell in cells if not cell.run.learns for row in cell.run.rows]
            if rows:
                times = [row.exploration_time_s for row in rows]
                levels.append(
                    ReferenceLevel(policy, sum(times) / len(times), sum(row.success for row in rows) / len(rows))
                )
        if curves:
            picture = learning_picture(
                f"learning-{number:02d}", curves, levels, highest_s=highest, ceiling_s=_limit_s(study.cells)
            )
            title = shown_setting(setting)
            pictures.append(replace(picture, alt=f"{title}. {picture.alt}", caption=f"{title}. {picture.caption}"))
    return PageSection("Learning curves", pictures=tuple(pictures))


def _limit_s(cells: Sequence[ReportedCell]) -> float:
    """No mean time is above this, so neither is the end of an interval."""
    limits = [cell.run.settings.get("task", {}).get("time_limit_s", inf) for cell in cells]
    return max(limits, default=inf)


def _highest(study: StudySource) -> float:
    """A limit for all curves alike: a standard deviation over seeds above the highest mean."""
    highest = 0.0
    for (_, policy), cells in study.groups.items():
        curve = curve_of(policy, [cell.run.rows for cell in cells])
        means = means_of(curve.costs, curve.trials)[:, window_of(curve.trials) - 1 :]
        highest = max(highest, float((means.mean(axis=0) + means.std(axis=0)).max()))
    return 1.08 * highest


def _policies(study: StudySource, settings: list[Setting]) -> list[PageSection]:
    """Of each choice of settings the policy that the first seed learned."""
    arrows: list[Picture] = []
    machines: dict[Machine, str] = {}
    values: list[Picture] = []
    number = 0
    for (setting, policy), cells in study.groups.items():
        document = cells[0].run.document
        if setting not in settings or document is None or document.foreign is not None:
            continue
        title = f"{policy}, {shown_setting(setting)}, seed {cells[0].seed}"
        number += 1
        arrows += arrows_pictures(f"policy-{number:02d}", document, title)
        q = q_picture(f"q-{number:02d}", document, title)
        values += [q] if q is not None else []
        machine = machine_in(document)
        if machine is not None:
            machines.setdefault(machine, shown_setting(setting))
    text = ("The policy of the first seed of each choice of settings.",) if arrows else ()
    sections = [PageSection("Policies", text, pictures=tuple(arrows)), PageSection("Q values", pictures=tuple(values))]
    for number, (machine, served) in enumerate(list(machines.items())[:_MOST_AUTOMATA], 1):
        sections.append(
            automaton_section(
                machine, f"automaton-{number:02d}", f"Automaton {number}", f"Gives the states of {served}."
            )
        )
    return sections


def _logs(study: StudySource) -> list[PageSection]:
    paths: list[Path] = []
    chosen: list[tuple[Path, str]] = []
    for cells in study.groups.values():
        found = [(cell, logs_in(cell.run.path)) for cell in cells]
        paths += [path for _, logs in found for path in logs]
        cell, logs = found[0]
        if logs:
            chosen.append((logs[-1], f"{cell.policy}, {shown_setting(cell.setting)}, seed {cell.seed}, last trial"))
    return log_sections(paths, chosen[:_MOST_FORCES])


def _summary(cells: list[ReportedCell]) -> dict[str, Cell]:
    """A line of ``summary.csv``: what cells that differ in their seed only came to."""
    rows = [row for cell in cells for row in cell.run.rows]
    late = [row for cell in cells for row in cell.run.late]
    mean, low, high = mean_with_interval([_mean_s(cell) for cell in cells], _limit_s(cells))
    figures = summary_cells(rows, late)
    success_low, success_high = exact_interval(sum(row.success for row in late), len(late))
    fields: dict[str, Cell] = {
        name: value if is_number(value) else shown_value(value) for name, value in cells[0].fields.items()
    }
    return {
        **fields, "policy": cells[0].policy, "seeds": len(cells), **figures, "success_low": round(success_low, 4),
        "success_high": round(success_high, 4), "mean_s": round(mean, 4),
        "mean_s_low": None if low is None else round(low, 4), "mean_s_high": None if high is None else round(high, 4),
    }  # fmt: skip
