"""The page of ``palpate explore``: learning in a grid world beside what is possible there."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from pathlib import Path
from typing import Any, Final

from palpate.adapters.visualisation.report.canvas import COLOURS, drawn
from palpate.adapters.visualisation.report.files import is_there, number, read_json, read_table
from palpate.adapters.visualisation.report.learning_pictures import (
    Axes,
    LearningCurve,
    ReferenceLevel,
    learning_picture,
)
from palpate.adapters.visualisation.report.page import Page, PageSection, PageTable, Picture, counted, share
from palpate.adapters.visualisation.report.policy_pictures import arrows_pictures
from palpate.adapters.visualisation.report.run_page import table_sections
from palpate.adapters.visualisation.report.run_source import policy_in
from palpate.core.errors import OutputError
from palpate.core.policy import PolicyDocument
from palpate.simulation.grid import GOAL, WALL

_SHADES = ("#d6e6f2", "#fae3d3", "#d8efe5", "#efdcea", "#f7ecd0", "#dceef8", "#e8e8d4", "#e6e6e6")


def grid_picture(name: str, document: PolicyDocument, rows: Sequence[str], title: str) -> Picture:
    """The best action of each cell's sensor value, which is a state of the policy; each value has one colour."""
    table = {row.state: row for row in document.table}
    steps = {action.name: action.displacement_mm for action in document.actions}
    width, height = max(map(len, rows)), len(rows)
    side_in = min(0.7, 6.0 / width)
    with drawn(side_in * height + 0.5, max(side_in * width + 0.3, 2.5)) as canvas:
        from matplotlib.patches import Rectangle

        axes = canvas.figure.add_subplot()
        axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), aspect="equal")
        axes.axis("off")
        for y, line in enumerate(rows):
            for x, letter in enumerate(line):
                goal = letter in (GOAL, ".")
                entry = table.get(letter)
                shade = "#4b5563" if letter == WALL else "white"
                if entry is not None:
                    shade = _SHADES[document.states.index(letter) % len(_SHADES)]
                axes.add_patch(Rectangle((x - 0.48, y - 0.48), 0.96, 0.96, facecolor=shade, linewidth=0.0))
                if goal:
                    axes.plot([x], [y], marker="*", markersize=30 * side_in, color=COLOURS[1])
                if entry is None:
                    continue
                axes.text(x - 0.43, y - 0.43, letter, ha="left", va="top", fontsize=12 * side_in, color="#374151")
                if entry.visits:
                    # Moves go upwards with y, rows are counted downwards.
                    dx, dy = (0.3 * value / hypot(*steps[entry.action]) for value in steps[entry.action])
                    axes.annotate(
                        "", (x + dx, y - dy), (x - dx, y + dy),
                        arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 2.2 * side_in,
                                    "shrinkA": 0, "shrinkB": 0, "mutation_scale": 18 * side_in},
                    )  # fmt: skip
    moves = "; ".join(f"{row.state}: {row.action}" for row in document.table if row.visits)
    caption = f"{title}. Star: the goal. Cells of one letter and colour look alike to the sensor."
    return Picture(name, f"Best move for each sensor value. {moves}.", caption, canvas.content)


_BOUNDS: Final = (
    ("full_information", "full information"), ("belief_optimum", "belief-state optimum"),
    ("random_walk", "random walk"),
)  # fmt: skip
_SCORES: Final = ("seed", "first", "last", "reached", "greedy", "greedy_reaches")


def explore_page(folder: Path, title: str, *, logs: bool) -> Page:
    """Put together the page of runs in a grid world."""
    summary = read_json(folder / "summary.json")
    try:
        settings, scores = summary["settings"], [_score(run) for run in summary["runs"]]
        bounds = [(words, number(summary[key])) for key, words in _BOUNDS if summary[key] is not None]
        rows, state = [str(row) for row in settings["map"]], str(settings["state"])
        learning = dict(settings["learning"])
    except (KeyError, TypeError, ValueError) as error:
        problem = f"is no summary of palpate explore ({error})"
        raise OutputError(str(folder / "summary.json"), problem, "explore again") from error
    curve = _curve(folder / "trials.csv", f"{learning.get('learner')}, states: {state}")
    levels = [ReferenceLevel(words, value) for words, value in bounds]
    axes = Axes(cost="steps to the goal", unit="steps", success="goal reached")
    facts = [("Learner", str(learning.get("learner"))), ("States", state), ("Seeds", str(len(scores)))]
    facts += [("Trials of each", str(settings.get("trials"))), ("Map", " / ".join(rows))]
    return Page(
        title=title,
        kind="learning in a grid world",
        facts=tuple(facts),
        sections=(
            _figures(scores, bounds),
            PageSection("Learning curve", pictures=(learning_picture("learning", [curve], levels, axes),)),
            *_policy(folder, [int(score["seed"]) for score in scores], rows),
            PageSection("Settings", listing="".join(f"{name} = {value}\n" for name, value in learning.items())),
        ),
        summary=tuple({**score, **{key: summary[key] for key, _ in _BOUNDS}} for score in scores),
    )


def _score(run: dict[str, Any]) -> dict[str, Any]:
    return {name: int(run[name]) if name == "seed" else number(run[name]) for name in _SCORES}


def _figures(scores: list[dict[str, Any]], bounds: list[tuple[str, float]]) -> PageSection:
    head = ("seed", "first trials [steps]", "last trials [steps]", "goal reached", "greedy, exact [steps]")
    rows = tuple(
        (str(s["seed"]), f"{s['first']:.2f}", f"{s['last']:.2f}", share(s["reached"]), f"{s['greedy']:.2f}")
        for s in scores
    )
    possible = "; ".join(f"{words} {value:.2f}" for words, value in bounds)
    text = f"What is possible, mean steps: {possible}."
    return PageSection("In figures", (text,), (PageTable("A line for each seed", head, rows),))


def _curve(path: Path, label: str) -> LearningCurve:
    steps: dict[str, list[float]] = {}
    reached: dict[str, list[bool]] = {}
    for row in read_table(path, ("seed", "steps", "reached")):
        try:
            steps.setdefault(row["seed"], []).append(number(row["steps"]))
        except ValueError as error:
            raise OutputError(str(path), f"is damaged ({error})", "explore again") from error
        reached.setdefault(row["seed"], []).append(row["reached"] == "True")
    if not steps:
        raise OutputError(str(path), "holds no trial", "explore again")
    return LearningCurve(label, tuple(map(tuple, steps.values())), tuple(map(tuple, reached.values())))


def _policy(folder: Path, seeds: list[int], rows: list[str]) -> list[PageSection]:
    """What the first seed learned: over the map where a state is a symbol, otherwise over the states."""
    path = next((p for p in (folder / f"policy-{seed}.json" for seed in seeds) if is_there(p)), None)
    document = None if path is None else policy_in(path)
    if path is None or document is None:
        return []
    title = f"Policy of seed {path.stem.removeprefix('policy-')}"
    on_map = set("".join(rows)) & set(document.states) == set(document.states)
    if on_map:
        pictures: tuple[Picture, ...] = (grid_picture("policy", document, rows, title),)
    else:
        pictures = arrows_pictures("policy", document, title, up=True)
    text = f"{counted(len(document.states), 'state')}, {counted(len(document.actions), 'action')}."
    return table_sections(document, "policy", title, text, pictures)
