"""The page of ``palpate compare``: strategies beside each other, with success, time and force of each."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from palpate.adapters.experiments import shown_interval
from palpate.adapters.log import LOG_FOLDER
from palpate.adapters.visualisation.report.canvas import COLOURS, drawn
from palpate.adapters.visualisation.report.files import is_there, number, read_json, read_run_toml, read_table
from palpate.adapters.visualisation.report.logs import logs_in
from palpate.adapters.visualisation.report.page import Page, PageSection, PageTable, Picture, share, shown_facts
from palpate.adapters.visualisation.report.run_page import log_sections, settings_section
from palpate.core.errors import OutputError

Interval = tuple[float, float | None, float | None]
"""Value, lower and upper end; None twice where no interval can be stated."""


@dataclass(frozen=True)
class Strategy:
    """Success and times of a strategy; ``slow_s`` is the 95th percentile."""

    label: str
    success: tuple[float, float, float]
    time_s: Interval
    slow_s: Interval


def strategies_picture(strategies: Sequence[Strategy], caption: str) -> Picture:
    """A line for each strategy, the first at the top, with its success to the left and its times to the right."""
    with drawn(1.5 + 0.42 * len(strategies)) as canvas:
        left, right = canvas.figure.subplots(1, 2, sharey=True, width_ratios=(1.0, 1.5))
        for row, strategy in enumerate(strategies):
            _bar(left, row, strategy.success, COLOURS[2], "o")
            _bar(right, row - 0.13, strategy.time_s, COLOURS[0], "o", "median" if row == 0 else None)
            _bar(right, row + 0.13, strategy.slow_s, COLOURS[1], "s", "95th percentile" if row == 0 else None)
        left.set_yticks(range(len(strategies)), [strategy.label for strategy in strategies])
        left.set(xlim=(-0.04, 1.04), xlabel="success", ylim=(len(strategies) - 0.5, -0.5))
        left.xaxis.set_major_formatter(lambda value, _: f"{value:.0%}")
        right.set(xlabel="exploration time [s]")
        right.set_xlim(left=0.0)
        canvas.figure.legend(*right.get_legend_handles_labels(), loc="outside upper right", ncols=2, frameon=False)
    described = [
        f"{s.label}: success {share(s.success[0])}, median {s.time_s[0]:.2f} s, 95th percentile {s.slow_s[0]:.2f} s"
        for s in strategies
    ]
    return Picture("strategies", f"Success and time of each strategy. {'; '.join(described)}.", caption, canvas.content)


def _bar(axes: Any, place: float, interval: Interval, colour: str, mark: str, label: str | None = None) -> None:
    middle, low, high = interval
    if low is not None:
        axes.hlines(place, low, high, color=colour, linewidth=2.0)
    axes.plot([middle], [place], mark, color=colour, markersize=6, label=label)


_NUMBERS: Final = (
    "success", "success_low", "success_high", "median_s", "p95_s", "peak_force_N",
)  # fmt: skip
_ENDS: Final = ("median_s_low", "median_s_high", "p95_s_low", "p95_s_high")
"""Empty where no interval can be stated."""
_MOST_FORCES: Final = 8


def compare_page(folder: Path, title: str, *, logs: bool) -> Page:
    """Put together the page of a comparison."""
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
    shown = [("Arm", settings.get("arm")), ("Scenario", settings.get("scenario")), ("Seed", settings.get("seed"))]
    shown += [
        ("Trials of each", facts.get("trials")),
        ("Capture half-width [mm]", rows[0].get("capture_half_width_mm")),
    ]
    finished = not is_there(folder / "summary.json") or read_json(folder / "summary.json").get("finished", True)
    return Page(
        title=title,
        kind="a comparison of strategies on the same trials",
        facts=shown_facts(shown),
        notices=() if finished else ("This comparison ended early: strategies or trials are missing.",),
        sections=tuple(sections),
        summary=tuple(dict(row) for row in rows),
    )


def _side_by_side(strategies: list[Strategy], rows: list[dict[str, str]]) -> PageSection:
    caption = (
        "Bars: 95 % intervals over trials, exact of success, by order statistics of times, where there are enough."
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
    picture = strategies_picture(strategies, caption)
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
