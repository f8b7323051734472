"""The page of ``palpate compare``."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from palpate.adapters.experiments.statistics import shown_interval
from palpate.adapters.log.trial_recorder import LOG_FOLDER
from palpate.adapters.visualisation.report.compare_pictures import Strategy, strategies_picture
from palpate.adapters.visualisation.report.files import is_there, number, read_json, read_run_toml, read_table
from palpate.adapters.visualisation.report.logs import logs_in
from palpate.adapters.visualisation.report.page import Page, PageSection, PageTable, share
from palpate.adapters.visualisation.report.run_page import log_sections, settings_section
from palpate.core.errors import OutputError

_NUMBERS: Final = (
    "success", "success_low", "success_high", "median_s", "p95_s", "peak_force_N",
)  # fmt: skip
_ENDS: Final = ("median_s_low", "median_s_high", "p95_s_low", "p95_s_high")
"""Empty where no interval can be stated."""
_MOST_FORCES: Final = 8


def compare_page(folder: Path, title: str, *, logs: bool) -> Page:
    """Put together the page of a comparison.

    Args:
        folder: Its folder.
        title: The page's heading.
        logs: Whether to read logs.

    Raises:
        OutputError: A file is missing or damaged.
        LogError: A log is.
    """
    path = folder / "compare.csv"
    rows = read_table(path, ("policy", "trials", *_NUMBERS, *_ENDS))
    if not rows:
        raise OutputError(str(path), "holds no strategy", "let palpate compare finish")
    strategies = [_strategy(path, row) for row in rows]
    sections = [_side_by_side(strategies, rows)]
    if logs:
        paths = logs_in(folder)
        firsts: dict[Path, Path] = {}
        for log in paths:
            firsts.setdefault(log.parent, log)
        order = {strategy.label: number for number, strategy in enumerate(strategies)}
        firsts = dict(sorted(firsts.items(), key=lambda pair: order.get(pair[0].name, len(order))))
        names = [(log, f"{parent.relative_to(folder / LOG_FOLDER)}, first trial") for parent, log in firsts.items()]
        sections += log_sections(paths, names[:_MOST_FORCES])
    sections.append(settings_section(folder / "run.toml"))
    settings, facts = read_run_toml(folder)
    told = [("Arm", settings.get("arm")), ("Scenario", settings.get("scenario")), ("Seed", settings.get("seed"))]
    told += [("Trials of each", facts.get("trials")), ("Capture half-width [mm]", rows[0].get("capture_half_width_mm"))]
    finished = not is_there(folder / "summary.json") or read_json(folder / "summary.json").get("finished", True)
    return Page(
        title=title,
        kind="a comparison of strategies on the same trials",
        facts=tuple((name, str(value)) for name, value in told if value not in (None, "")),
        notices=() if finished else ("This comparison ended early: strategies or trials are missing.",),
        sections=tuple(sections),
        summary=tuple(dict(row) for row in rows),
    )


def _side_by_side(strategies: list[Strategy], rows: list[dict[str, str]]) -> PageSection:
    caption = (
        "Bars: 95 % intervals over trials, Wilson's of success, by order statistics of times, where there are enough."
    )
    head = ("policy", "success", "median [s]", "95th percentile [s]", "peak force [N]", "trials")
    lines = tuple(
        (
            s.label, "{} [{}, {}]".format(*map(share, s.success)), shown_interval(*s.time_s),
            shown_interval(*s.slow_s), f"{float(row['peak_force_N']):.1f}", row["trials"],
        )
        for s, row in zip(strategies, rows, strict=True)
    )  # fmt: skip
    table = PageTable("Brackets: 95 % intervals", head, lines)
    picture = strategies_picture("strategies", strategies, caption)
    return PageSection("Side by side", tables=(table,), pictures=(picture,))


def _strategy(path: Path, row: dict[str, str]) -> Strategy:
    try:
        v = {name: number(row[name]) for name in _NUMBERS}
        ends = {name: number(row[name]) if row[name] else None for name in _ENDS}
    except ValueError as error:
        raise OutputError(str(path), f"is damaged ({error})", "let palpate compare run again") from error
    return Strategy(
        row["policy"],
        (v["success"], v["success_low"], v["success_high"]),
        (v["median_s"], ends["median_s_low"], ends["median_s_high"]),
        (v["p95_s"], ends["p95_s_low"], ends["p95_s_high"]),
    )
