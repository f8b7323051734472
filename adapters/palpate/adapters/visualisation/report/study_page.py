"""Report page about a study, with results, success and time against each swept setting, and learning curves."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from palpate.adapters.experiments import TrialRow, mean_with_interval, shown_interval
from palpate.adapters.experiments.study import STUDY_FILE, SUMMARY, Study, StudyFolder, setting_of
from palpate.adapters.visualisation.report.page import Page, PageSection, PageTable, Picture
from palpate.adapters.visualisation.report.pictures import learning_picture, mean_s, sweep_picture
from palpate.adapters.visualisation.report.run_page import HEAD, RunSource, figures_row, settings_section
from palpate.core.errors import OutputError

Setting = tuple[tuple[str, str], ...]
"""Names and values of swept settings."""


class ReportedCondition(NamedTuple):
    """A finished run in the study, with one policy, one seed and one combination of settings."""

    fields: Mapping[str, Any]
    policy: str
    seed: int
    source: RunSource

    @property
    def setting(self) -> Setting:
        """The run's settings in a form that can be compared."""
        return tuple((name, _shown(value)) for name, value in self.fields.items())


def study_page(folder: Path) -> Page:
    """Assemble the page about a study."""
    study, places = Study.read(folder / STUDY_FILE), StudyFolder(folder).conditions
    runs = [
        ReportedCondition(
            {name: setting_of(condition.config, name) for name in study.fields},
            condition.policy, condition.config.seed, RunSource.read(places / condition.name),
        )
        for condition in study.conditions()
        if (places / condition.name / SUMMARY).exists()
    ]  # fmt: skip
    if not runs:
        raise OutputError(str(folder), "is a study without a finished condition", "run palpate study first")
    runs.sort(key=lambda run: ([_rank(value) for value in run.fields.values()], run.policy, run.seed))
    groups: dict[tuple[Setting, str], list[ReportedCondition]] = {}
    for run in runs:
        groups.setdefault((run.setting, run.policy), []).append(run)
    swept = {name: _distinct(run.fields[name] for run in runs) for name in study.fields}
    swept = {name: values for name, values in swept.items() if len(values) > 1}
    sections = (
        PageSection("Summary", tables=(_figures(groups),)),
        PageSection("Effect of the swept settings", pictures=tuple(_sweep(name, swept[name], runs) for name in swept)),
        PageSection("Learning curves", pictures=tuple(_curves(groups))),
        settings_section(folder / STUDY_FILE),
    )
    facts = [("Conditions", str(len(runs))), ("Run on", "simulator"), ("Date", max(run.source.date for run in runs))]
    facts += [("Part", "; ".join(_distinct(run.source.facts.get("part", "") for run in runs)))]
    facts += [(f"Swept: {name}", ", ".join(values)) for name, values in swept.items()]
    facts += [("Policies", ", ".join(_distinct(run.policy for run in runs)))]
    facts += [("Seeds", ", ".join(_distinct(run.seed for run in runs)))]
    facts += [("Total trials", str(sum(len(run.source.rows) for run in runs)))]
    missing = study.count - len(runs)
    notices = (f"This study is unfinished: {missing} of {study.count} conditions are missing.",) if missing else ()
    return Page(folder.resolve().name, "study", tuple(facts), sections, notices)


def _figures(groups: Mapping[tuple[Setting, str], Sequence[ReportedCondition]]) -> PageTable:
    rows = []
    for (setting, policy), runs in groups.items():
        name = ", ".join([policy, *(f"{field} = {value}" for field, value in setting)])
        _, trials, success, _, *others = figures_row(name, _late(runs))
        mean = shown_interval(*mean_with_interval([mean_s(run.source.late) for run in runs]))
        rows.append((name, str(len(runs)), trials, success, mean, *others))
    caption = (
        "Brackets: 95 % intervals; exact for success, Student's t over seeds for the mean, order statistics for"
        " medians. For learners, only the last trials are used"
    )
    return PageTable(caption, (HEAD[0], "seeds", *HEAD[1:]), tuple(rows))


def _sweep(field: str, values: Sequence[str], runs: Sequence[ReportedCondition]) -> Picture:
    lines: dict[str, dict[str, list[Sequence[TrialRow]]]] = {}
    for run in runs:
        value = _shown(run.fields[field])
        lines.setdefault(run.policy, {}).setdefault(value, []).append(run.source.late)
    return sweep_picture(field, values, lines)


def _curves(groups: Mapping[tuple[Setting, str], Sequence[ReportedCondition]]) -> list[Picture]:
    """Return a picture for each combination of settings, with learners as curves and other policies as lines."""
    pictures = []
    for setting in list(dict.fromkeys(setting for setting, _ in groups))[:12]:
        of_setting = {policy: runs for (own, policy), runs in groups.items() if own == setting}
        curves = {name: [run.source.rows for run in own] for name, own in of_setting.items() if own[0].source.learns}
        levels = {name: _late(own) for name, own in of_setting.items() if name not in curves}
        if curves:
            title = ", ".join(f"{name} = {value}" for name, value in setting)
            pictures.append(learning_picture(curves, levels, f"{title}. " if title else ""))
    return pictures


def _late(runs: Sequence[ReportedCondition]) -> list[TrialRow]:
    return [row for run in runs for row in run.source.late]


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return ", ".join(map(_shown, value)) if isinstance(value, list) else str(value)


def _distinct(values: Any) -> list[str]:
    return [_shown(value) for value in sorted({_shown(value): value for value in values}.values(), key=_rank)]


def _rank(value: Any) -> tuple[bool, float, str]:
    """Sort numbers by value and put them first; sort all other values by name."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return (False, float(value), "") if number else (True, 0.0, _shown(value))
