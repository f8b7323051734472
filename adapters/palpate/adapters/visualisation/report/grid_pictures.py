"""A policy over a grid world: an arrow in every cell."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from palpate.adapters.visualisation.report.canvas import COLOURS, drawn
from palpate.adapters.visualisation.report.page import Picture
from palpate.core.policy import PolicyDocument
from palpate.simulation.grid.maps import GOAL, WALL

_SHADES = ("#d6e6f2", "#fae3d3", "#d8efe5", "#efdcea", "#f7ecd0", "#dceef8", "#e8e8d4", "#e6e6e6")


def grid_picture(name: str, document: PolicyDocument, rows: Sequence[str], title: str) -> Picture:
    """The best action of what the sensor says, in each cell; cells that it cannot tell apart have one colour.

    Args:
        name: The picture's file name.
        document: A policy whose states are sensor values.
        rows: The map, the upper row first.
        title: Of what it is.
    """
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
    told = "; ".join(f"{row.state}: {row.action}" for row in document.table if row.visits)
    caption = f"{title}. Star: the goal. Cells of one letter and colour look alike to the sensor."
    return Picture(name, f"Best move for each sensor value. {told}.", caption, canvas.png)
