"""Picture of a learned policy, with an arrow for the action in each state."""

from math import hypot
from textwrap import wrap
from typing import Any, Final

from palpate.adapters.visualisation.report.page import Picture
from palpate.adapters.visualisation.report.pictures import drawn
from palpate.core.policy import LEARNED, PolicyDocument, TableRow

_MOST_STATES: Final = 48
_COLUMNS: Final = 6
_SIGNS: Final = {"-": -1, "0": 0, "+": 1}
_UNKNOWN: Final = "#ececec"
Place = tuple[int, int]
"""Column and row, counted from the left and from the top."""


def policy_picture(document: PolicyDocument) -> Picture:
    """Draw the best action for each state as seen from above, with x to the right and y down.

    The paper's position and torque regions become two maps. Each state lies on the side of the hole where it is
    measured, so correct arrows point to the middle. For a torque, the hole is in the direction (-ty, tx).
    """
    rows = [row for row in document.table if row.visits or row.source != LEARNED] or list(document.table)
    rows = sorted(rows, key=lambda row: -row.visits)[:_MOST_STATES]
    places = _on_maps(document)
    if places is None:
        order = [state for state in document.states if state in {row.state for row in rows}]
        places = {state: (n % _COLUMNS, n // _COLUMNS) for n, state in enumerate(order)}
    shown = [row for row in document.table if row.state in places]
    steps = {action.name: action.displacement_mm[:2] for action in document.actions}
    longest = max((hypot(*step) for step in steps.values()), default=0.0) or 1.0
    columns, lines = (1 + max(place[axis] for place in places.values()) for axis in (0, 1))
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    with drawn(0.6 + 0.95 * lines, 1.4 + 0.95 * columns) as canvas:
        axes = canvas.figure.add_subplot()
        axes.set(xlim=(-0.5, columns - 0.5), ylim=(lines - 0.5, -0.5), aspect="equal")
        axes.set_axis_off()
        known = [row.value for row in shown if row.visits and row.value is not None] or [0.0]
        spread = (max(known) - min(known)) or 1.0
        # The darkest colours would hide the arrows.
        values = ScalarMappable(Normalize(max(known) - spread / 0.7, max(known)), colormaps["viridis"])
        scale = canvas.figure.colorbar(values, ax=axes, shrink=0.8, label="value")
        scale.ax.set_ylim(max(known) - spread, max(known))
        for row in shown:
            seen = row.value if row.visits else None
            colour = _UNKNOWN if seen is None else values.to_rgba(seen)  # type: ignore[arg-type]
            _draw(axes, places[row.state], row, steps, longest, colour)
    best = "; ".join(f"{row.state}: {row.action}" for row in shown[:20])
    caption = "Arrow: best action in the state. Colour: its value. Grey: state never visited."
    if len(shown) < len(document.states):
        caption += f" The {len(shown)} most visited of {len(document.states)} states."
    return Picture(f"Best action of each state. {best}.", caption, canvas.content)


def _on_maps(document: PolicyDocument) -> dict[str, Place] | None:
    """Return the positions of position regions and, to their right, of torque regions, or None for other states."""
    places: dict[str, Place] = {}
    for state in document.states:
        words = state.split(" ")
        if len(words) != 2 or any(word[-1] not in _SIGNS for word in words):
            return None
        first, second = (_SIGNS[word[-1]] for word in words)
        if [word[:-1] for word in words] == ["x", "y"]:
            places[state] = first + 1, second + 1
        elif [word[:-1] for word in words] == ["tx", "ty"]:
            places[state] = second + 5, 1 - first
        else:
            return None
    return places


def _draw(
    axes: Any, place: Place, row: TableRow, steps: dict[str, tuple[float, float]], longest: float, colour: Any
) -> None:
    from matplotlib.patches import Rectangle

    column, line = place
    axes.add_patch(Rectangle((column - 0.48, line - 0.48), 0.96, 0.96, facecolor=colour))
    name = "\n".join(wrap(row.state, 13)[:3])
    axes.text(column, line - 0.45, name, ha="center", va="top", fontsize=7)
    source = row.source if row.source != LEARNED else ""
    axes.text(column, line + 0.4, source, ha="center", va="center", fontsize=7)
    if row.source == LEARNED and not row.visits:
        return
    x, y = (0.24 * value / longest for value in steps[row.action])
    if hypot(x, y) == 0.0:
        axes.text(column, line, "\n".join(wrap(row.action, 12)), ha="center", va="center", fontsize=8)
        return
    arrow = {"arrowstyle": "-|>", "linewidth": 2.0, "color": "black", "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (column + x, line + 0.1 + y), (column - x, line + 0.1 - y), arrowprops=arrow)
