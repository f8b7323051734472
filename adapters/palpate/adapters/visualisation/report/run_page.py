"""The page of a run of ``palpate train`` or ``palpate run``."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from palpate.adapters.experiments import WINDOW, TrialRow, render_table, shown_interval, summary_of
from palpate.adapters.log import TrialLog, read_log
from palpate.adapters.visualisation.report.automaton_section import automaton_section, machine_in
from palpate.adapters.visualisation.report.files import is_there, read_text
from palpate.adapters.visualisation.report.learning_pictures import learning_picture
from palpate.adapters.visualisation.report.logs import force_picture, logs_in, spread_over, timing_section
from palpate.adapters.visualisation.report.page import (
    Cell,
    Page,
    PageSection,
    PageTable,
    Picture,
    counted,
    share,
    shown_facts,
)
from palpate.adapters.visualisation.report.policy_pictures import arrows_pictures, q_picture
from palpate.adapters.visualisation.report.run_source import RunSource, curve_of
from palpate.adapters.visualisation.report.touch_pictures import touch_pictures
from palpate.core.policy import PolicyDocument

MOST_TIMED = 8
"""Logs that timing is taken from: reading all of them would take long."""

_MOST_FAILED = 5


def run_page(folder: Path, title: str, *, logs: bool) -> Page:
    """Put together the page of a run."""
    run = RunSource.read(folder)
    sections = [_figures(run), _curve(run)]
    if run.document is not None:
        sections += policy_sections(run.document, run.policy)
    if logs:
        sections += log_sections(logs_in(folder), list(_drawn_trials(run)))
    sections.append(settings_section(folder / "run.toml"))
    return Page(
        title=title,
        kind="a training run" if run.learns else "a run without learning",
        facts=facts_of(run),
        notices=notices_of(run),
        sections=tuple(sections),
        summary=({"policy": run.policy, **summary_cells(run.rows, run.late)},),
    )


def facts_of(run: RunSource) -> tuple[tuple[str, str], ...]:
    """What was run."""
    facts = [("Arm", run.settings.get("arm")), ("Scenario", run.settings.get("scenario"))]
    facts += [("Policy", run.facts.get("policy")), ("Seed", run.settings.get("seed"))]
    facts += [("Trials", len(run.rows))]
    inside = run.summary.get("holes_inside_area")
    if isinstance(inside, float) and inside < 1.0:
        # No strategy can do better than that.
        facts.append(("Holes inside the exploration area", share(inside)))
    versions = run.facts.get("versions")
    if isinstance(versions, dict):
        facts.append(("Made with", ", ".join(f"{name} {version}" for name, version in versions.items())))
    return shown_facts(facts)


def notices_of(run: RunSource) -> tuple[str, ...]:
    """Notices for the top of a run's page."""
    notices = []
    if run.missing:
        asked = len(run.rows) + run.missing
        notices.append(f"This run is unfinished: {len(run.rows)} of {counted(asked, 'trial')} have been made.")
    marked = sum(bool(row.marked) for row in run.rows)
    if marked:
        notices.append(f"{counted(marked, 'trial')} marked, because their timing was not good enough.")
    return tuple(notices)


def summary_cells(rows: Sequence[TrialRow], late: Sequence[TrialRow]) -> dict[str, Cell]:
    """A line of ``summary.csv`` about some trials: figures are of the late ones, the highest force is of all."""
    figures = summary_of(late)
    (success_low, success_high), (median_low, median_high) = figures["success_95"], figures["median_95_s"]
    return {
        "trials": len(rows), "counted": len(late), "success": figures["success"], "success_low": success_low,
        "success_high": success_high, "mean_s": round(sum(r.exploration_time_s for r in late) / len(late), 4),
        "median_s": figures["median_s"], "median_s_low": median_low, "median_s_high": median_high,
        "p95_s": figures["p95_s"], "peak_force_N": round(max(row.peak_force_N for row in rows), 3),
    }  # fmt: skip


def policy_sections(document: PolicyDocument, title: str) -> list[PageSection]:
    """The policy as arrows, its Q values, the automaton that gives its states; of a belief, its touch model."""
    learner = document.learner
    if learner is not None and learner.kind == "belief":
        text = f"A belief over the hole's place, {counted(learner.trials_learned, 'trial')} learned."
        pictures = touch_pictures("touch-policy", learner, title)
        return [PageSection("Policy", (text,), pictures=pictures, listing=render_table(document))]
    if document.foreign is not None or (learner is not None and learner.kind == "hmm"):
        return [PageSection("Policy", listing=render_table(document))]
    text = f"{counted(len(document.states), 'state')}, {counted(len(document.actions), 'action')}; "
    text += f"{learner.kind}, {counted(learner.trials_learned, 'trial')} learned." if learner else "nothing learned."
    visited = sum(row.visits > 0 for row in document.table)
    if learner and visited < len(document.states):
        text += f" {counted(len(document.states) - visited, 'state was', 'states were')} never visited."
    sections = [PageSection("Policy", (text,), pictures=arrows_pictures("policy", document, title))]
    q = q_picture("q-policy", document, title)
    if q is not None:
        sections.append(PageSection("Q values", pictures=(q,)))
    machine = machine_in(document)
    if machine is not None:
        sections.append(automaton_section(machine, text="Its states are the policy's."))
    return sections


def log_sections(paths: Sequence[Path], chosen: Sequence[tuple[Path, str]]) -> list[PageSection]:
    """Forces of single trials, and timing.

    Args:
        chosen: Which trials' forces are drawn, and what they are; those without a log are left out.
    """
    read = cache(read_log)
    pictures: list[Picture] = []
    for path, title in chosen:
        if path in paths:
            pictures.append(force_picture(f"force-{len(pictures) + 1:02d}", read(path), title))
    sections = []
    if pictures:
        text = "Each log can be seen whole with palpate log plot."
        sections.append(PageSection("Forces of single trials", (text,), pictures=tuple(pictures)))
    timed: list[TrialLog] = [read(path) for path in spread_over(paths, MOST_TIMED)]
    if timed:
        of = counted(len(timed), "log") if len(timed) == len(paths) else f"{len(timed)} of {len(paths)} logs"
        timing = timing_section(timed, of)
        sections += [timing] if timing is not None else []
    return sections


def settings_section(path: Path) -> PageSection:
    """A settings file, folded; without a listing where there is none."""
    return PageSection("Settings", listing=read_text(path) if is_there(path) else "")


def _figures(run: RunSource) -> PageSection:
    groups = [("all trials", run.rows)]
    if run.learns and len(run.rows) > 1:
        groups = [(f"first {len(run.late)}", run.rows[: len(run.late)]), (f"last {len(run.late)}", run.late), *groups]
    rows = []
    for name, part in groups:
        figures = summary_of(part)
        low, high = figures["success_95"]
        mean_s = sum(row.exploration_time_s for row in part) / len(part)
        rows.append(
            (
                name,
                f"{share(figures['success'])} [{share(low)}, {share(high)}]",
                f"{mean_s:.2f}",
                shown_interval(figures["median_s"], *figures["median_95_s"]),
                f"{figures['p95_s']:.2f}",
                f"{figures['peak_force_N']:.1f}",
            )
        )
    head = ("trials", "success", "mean [s]", "median [s]", "95th percentile [s]", "peak force [N]")
    caption = "Brackets: 95 % intervals, exact of success, by order statistics of medians (none below 6 trials)"
    outcomes = summary_of(run.rows)["outcomes"]
    text = "Outcomes: " + ", ".join(f"{count} {name}" for name, count in outcomes.items()) + "."
    return PageSection("In figures", (text,), (PageTable(caption, head, tuple(rows)), *drawn_values(run.rows)))


def drawn_values(rows: Sequence[TrialRow]) -> list[PageTable]:
    """What was drawn besides the hole's place: its range, and what it was in the first trials that failed."""
    table = []
    for name in rows[0].drawn:
        values = [row.drawn[name] for row in rows]
        failed = [f"{row.drawn[name]:.3g} (trial {row.trial})" for row in rows if not row.success]
        listed = ", ".join(failed[:_MOST_FAILED]) + (" ..." if len(failed) > _MOST_FAILED else "")
        table.append((name, f"{min(values):.3g}", f"{max(values):.3g}", listed or "none failed"))
    head = ("drawn for a trial or its batch", "lowest", "highest", "where trials failed")
    return [PageTable("What was drawn, besides the hole's place", head, tuple(table))] if table else []


def _curve(run: RunSource) -> PageSection:
    label = f"moving average of {WINDOW}" if len(run.rows) >= WINDOW else "each trial"
    title = "Learning curve" if run.learns else "Trial by trial"
    return PageSection(title, pictures=(learning_picture("learning", [curve_of(label, [run.rows])]),))


def _drawn_trials(run: RunSource) -> list[tuple[Path, str]]:
    """The first and the last trial, and the one with the highest force."""
    first, last = run.rows[0], run.rows[-1]
    peak = max(run.rows, key=lambda row: (row.peak_force_N, -row.trial))
    chosen: dict[int, str] = {}
    for row, words in ((first, "first"), (last, "last"), (peak, "highest force")):
        chosen[row.trial] = f"{chosen[row.trial]} and {words}" if row.trial in chosen else words
    return [
        (run.path / "logs" / f"trial-{trial:05d}.mcap", f"Trial {trial} ({words})") for trial, words in chosen.items()
    ]
