"""Report page about a run of ``palpate train`` or ``palpate run``."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from palpate.adapters import experiments
from palpate.adapters.config import read_toml, run_facts
from palpate.adapters.experiments import load_policy
from palpate.adapters.files import read_text
from palpate.adapters.log import LOG_FOLDER, read_log, score_of, timeline
from palpate.adapters.visualisation.report.page import Page, PageSection, PageTable, Picture, success_of
from palpate.adapters.visualisation.report.pictures import mean_s
from palpate.adapters.visualisation.report.policy_picture import policy_picture
from palpate.core.errors import OutputError
from palpate.core.policy import PolicyDocument

_MOST_TRIPS: Final = 50
_LATE: Final = 25
"""Number of trials at the end of a learning run that represent the learned policy."""


@dataclass(frozen=True)
class RunSource:
    """A run's folder: trials, configuration, command data, and ``summary.json`` (empty until the run ends)."""

    path: Path
    rows: tuple[experiments.TrialRow, ...]
    settings: dict[str, Any]
    facts: dict[str, Any]
    summary: dict[str, Any]

    @classmethod
    def read(cls, path: Path) -> RunSource:
        """Read a run's folder."""
        folder, settings = experiments.RunFolder(path), read_toml(path / "run.toml")
        rows = folder.read_trials()
        if not rows:
            raise OutputError(str(path), "holds no finished trial", "there is nothing to report yet")
        return cls(path, tuple(rows), settings, run_facts(settings, path / "run.toml"), folder.summary())

    @property
    def learns(self) -> bool:
        """True if the policy learns during the run."""
        return bool(self.facts.get("command") == "train")

    @property
    def late(self) -> tuple[experiments.TrialRow, ...]:
        """Evaluated trials: all or, for a learning run, the last 25 trials, or the last half if that is fewer."""
        return self.rows[-min(_LATE, max(1, len(self.rows) // 2)) :] if self.learns else self.rows

    @property
    def missing(self) -> int:
        """Number of requested trials that were not run."""
        return max(0, int(self.facts.get("trials", 0)) - len(self.rows))

    @property
    def date(self) -> str:
        """Date of the last trial."""
        return time.strftime("%Y-%m-%d", time.localtime((self.path / "trials.csv").stat().st_mtime))

    @property
    def document(self) -> PolicyDocument | None:
        """Return the policy file, or None if there is none."""
        path = self.path / "policy.json"
        return load_policy(path) if path.exists() else None


def run_page(folder: Path, *, logs: bool) -> Page:
    """Return the page about a run."""
    run = RunSource.read(folder)
    sections = [_figures(run), PageSection("Trials", pictures=(_curve(run),))]
    if (document := run.document) is not None:
        sections.append(_policy(document))
    if logs:
        sections.append(PageSection("Forces in individual trials", _score(run), pictures=tuple(_forces(run))))
    sections.append(settings_section(folder / "run.toml"))
    notices = []
    if run.missing:
        notices.append(f"This run is unfinished: {len(run.rows)} of {len(run.rows) + run.missing} trials were run.")
    if flagged := sum(bool(row.flagged) for row in run.rows):
        notices.append(f"{flagged} trials are flagged for their timing.")
    kind = "training run" if run.learns else "run without learning"
    return Page(folder.resolve().name, kind, _facts(run), tuple(sections), tuple(notices))


def settings_section(path: Path) -> PageSection:
    """Return a section with a settings file, initially collapsed."""
    return PageSection("Settings", listing=read_text(path, "file"))


def figures_row(name: str, rows: Sequence[experiments.TrialRow]) -> tuple[str, ...]:
    """Return a row for the results table."""
    figures = experiments.summary_of(rows)
    return (
        name,
        str(len(rows)),
        success_of(rows),
        f"{mean_s(rows):.2f}",
        experiments.shown_interval(figures["median_s"], *figures["median_95_s"]),
        f"{figures['p95_s']:.2f}",
        f"{figures['peak_force_N']:.1f}",
        str(sum(figures["trips"].values())),
    )


HEAD: Final = ("", "trials", "success", "mean [s]", "median [s]", "95th percentile [s]", "peak force [N]", "trips")
CAPTION: Final = "Brackets: 95 % intervals; exact for success, order statistics for medians"


def _facts(run: RunSource) -> tuple[tuple[str, str], ...]:
    facts: list[tuple[str, object]] = [("Policy", run.facts.get("policy")), ("Arm", run.settings.get("arm"))]
    facts += [("Part", run.facts.get("part")), ("Run on", run.facts.get("rig", "simulator")), ("Date", run.date)]
    facts += [("Scenario", run.settings.get("scenario"))]
    facts += [("Seed", run.settings.get("seed")), ("Trials", len(run.rows))]
    if "claim" in run.summary:
        facts.append(("Claim", f"{run.summary['claim']}: {run.summary.get('verdict')}"))
    versions = run.facts.get("versions", {})
    facts.append(("Software", ", ".join(f"{name} {version}" for name, version in versions.items())))
    return tuple((name, str(value)) for name, value in facts if value not in (None, ""))


def _figures(run: RunSource) -> PageSection:
    rows = [figures_row("all trials", run.rows)]
    if run.learns and len(run.rows) > 1:
        count = len(run.late)
        rows += [figures_row(f"first {count}", run.rows[:count]), figures_row(f"last {count}", run.late)]
    outcomes = experiments.summary_of(run.rows)["outcomes"]
    text = "Outcomes: " + ", ".join(f"{count} {name}" for name, count in outcomes.items()) + "."
    tables = [PageTable(CAPTION, HEAD, tuple(rows))]
    if tripped := [(str(row.trial), row.trip) for row in run.rows if row.trip]:
        caption = f"Trips, each counted as a failure at the time limit: {len(tripped)} of {len(run.rows)} trials"
        tables.append(PageTable(caption, ("trial", "reason"), tuple(tripped[:_MOST_TRIPS])))
    return PageSection("Summary", text, tuple(tables))


def _policy(document: PolicyDocument) -> PageSection:
    learner = document.learner
    stateless = document.third_party is not None or (learner is not None and learner.kind in ("belief", "hmm"))
    pictures = () if stateless else (policy_picture(document),)
    return PageSection("Policy", pictures=pictures, listing=experiments.render_table(document))


def _log_of(run: RunSource, trial: int) -> Path:
    return run.path / LOG_FOLDER / f"trial-{trial:05d}.mcap"


def _score(run: RunSource) -> str:
    """Return the mean score for the latest trials with logs."""
    paths = [path for row in run.late[-_LATE:] if (path := _log_of(run, row.trial)).exists()]
    if not paths:
        return ""
    mean = sum(score_of(read_log(path)).score.total for path in paths) / len(paths)
    return f"AI for Industry Challenge score: {mean:.1f} of 100 (mean of the last {len(paths)} recorded trials)."


def _curve(run: RunSource) -> Picture:
    name, times_s = run.facts.get("policy", ""), [row.exploration_time_s for row in run.rows]
    alt = f"Exploration time of each trial. {name}: {times_s[0]:.3g} s at first, {times_s[-1]:.3g} s at the end."
    caption = "Failed trials are included with their actual duration."
    if run.learns:
        return Picture(alt, caption, experiments.learning_curve(run.rows, str(name)))
    limit_N = float(run.settings["task"]["max_force_N"])
    return Picture(alt, caption, experiments.trials_picture(run.rows, str(name), limit_N))


def _forces(run: RunSource) -> list[Picture]:
    """Return force plots for the first trial, the last trial, and the trial with the highest force."""
    peak = max(run.rows, key=lambda row: (row.peak_force_N, -row.trial))
    chosen: dict[int, tuple[experiments.TrialRow, str]] = {}
    for row, words in ((run.rows[0], "first"), (run.rows[-1], "last"), (peak, "highest force")):
        chosen[row.trial] = row, f"{chosen[row.trial][1]} and {words}" if row.trial in chosen else words
    pictures = []
    for row, words in chosen.values():
        if (path := _log_of(run, row.trial)).exists():
            caption = f"Trial {row.trial} ({words}): {', '.join(filter(None, (row.outcome, row.trip)))}."
            caption += f" Peak force {row.peak_force_N:.1f} N, {row.measured_peak_force_N:.1f} N measured."
            pictures.append(Picture(f"Force, torque, tip and decisions. {caption}", caption, timeline(read_log(path))))
    return pictures
