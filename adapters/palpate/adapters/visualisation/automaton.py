"""Pictures of machines. Matplotlib is imported only when one is drawn."""

import textwrap
from math import cos, degrees, hypot, sin
from typing import Any, Literal

from palpate.adapters.log import drawing
from palpate.adapters.visualisation.automaton_layout import Curve, Layout, Point, lay_out
from palpate.core.automata import Kind, Machine, shown_name, shown_output

_FONT_PT = 9.0
_LABEL_PT = 9.0
_LETTER_IN = 0.62 * _FONT_PT / 72  # a wide letter of the usual sans serif
_LINE_IN = 1.25 * _LABEL_PT / 72
_LEAST_RADIUS_IN = 0.27
_RIM_IN = 0.08
_SECOND_RIM_IN = 0.045
_NAME_LETTERS = 12
_MARGIN_IN = 0.3
_ARROW_PT = 8.0
_DPI = 110
# Dark enough to be read as text, and unlike for neighbours; an edge has the colour of the state that it leaves.
_COLOURS = (
    "#1f5fa8",
    "#b8430f",
    "#257a2c",
    "#a3232b",
    "#6a3d9a",
    "#7a5200",
    "#b0287f",
    "#3f4f5f",
    "#00788a",
    "#5b6b00",
)


def machine_picture(machine: Machine, title: str = "", file_format: Literal["svg", "png", "pdf"] = "svg") -> bytes:
    """States as circles, those that accept as double ones; edges with their symbols; the start with an arrow.

    An edge has the colour of the state that it leaves, and its label is where it leaves. Equal machines and titles give
    equal bytes. Pictures stay readable up to some 30 states with six edges each.
    """
    texts = _texts(machine)
    layout = lay_out(machine, _radius_in(texts), _LINE_IN)
    left, right, low, high = _extent(layout)
    with drawing(right - left, high - low, _DPI, file_format, {"svg.fonttype": "none"}, layout=None) as canvas:
        axes: Any = canvas.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(left, right), ylim=(low, high), aspect="equal")
        axes.axis("off")
        for curve in layout.curves:
            _draw_curve(axes, curve, _COLOURS[layout.ranks[curve.edge.source] % len(_COLOURS)])
        _draw_arrow(axes, "black", posA=layout.start[0], posB=layout.start[1])
        for state, text in enumerate(texts):
            _draw_state(axes, machine, layout, state, text)
        if title:
            axes.text(left + _MARGIN_IN, high - 0.1, title, va="top", fontsize=11.0, parse_math=False)
    return canvas.content


def _texts(machine: Machine) -> list[str]:
    texts = []
    for state, name in enumerate(machine.names):
        lines = textwrap.wrap(shown_name(name), _NAME_LETTERS)
        if machine.kind is Kind.MOORE:
            lines += textwrap.wrap(shown_output(machine.state_outputs[state]), _NAME_LETTERS)
        texts.append("\n".join(lines))
    return texts


def _radius_in(texts: list[str]) -> float:
    sizes = [
        hypot(_LETTER_IN * max(map(len, text.split("\n"))), 1.25 * _FONT_PT / 72 * (text.count("\n") + 0.5)) / 2
        for text in texts
    ]
    return max(_LEAST_RADIUS_IN, max(sizes) + _RIM_IN)


def _extent(layout: Layout) -> tuple[float, float, float, float]:
    """Left, right, bottom and top of the picture, with room for the labels."""
    points = [*layout.start]
    for x, y in layout.centres:
        points += [(x - layout.radius_in, y - layout.radius_in), (x + layout.radius_in, y + layout.radius_in)]
    for curve in layout.curves:
        points += [curve.label_at, _label_end(curve)]
    xs, ys = [x for x, _ in points], [y for _, y in points]
    return min(xs) - _MARGIN_IN, max(xs) + _MARGIN_IN, min(ys) - _MARGIN_IN, max(ys) + _MARGIN_IN


def _label_end(curve: Curve) -> Point:
    length_in = _LETTER_IN * len(curve.edge.label)
    x, y = curve.label_at
    return x + length_in * cos(curve.label_angle), y + length_in * sin(curve.label_angle)


def _draw_curve(axes: Any, curve: Curve, colour: str) -> None:
    from matplotlib.path import Path

    _draw_arrow(axes, colour, path=Path(curve.points, [Path.MOVETO, Path.CURVE4, Path.CURVE4, Path.CURVE4]))
    leftwards = cos(curve.label_angle) < -1e-9
    axes.text(
        *curve.label_at,
        curve.edge.label,
        color=colour,
        fontsize=_LABEL_PT,
        rotation=degrees(curve.label_angle) + (180.0 if leftwards else 0.0),
        rotation_mode="anchor",
        ha="right" if leftwards else "left",
        va="center_baseline",
        bbox={"boxstyle": "square,pad=0.08", "facecolor": "white", "edgecolor": "none"},
        zorder=3,
        parse_math=False,
    )


def _draw_arrow(axes: Any, colour: str, **way: Any) -> None:
    from matplotlib.patches import FancyArrowPatch

    style = f"-|>,head_length={_ARROW_PT},head_width={0.35 * _ARROW_PT}"
    axes.add_patch(
        FancyArrowPatch(**way, arrowstyle=style, color=colour, linewidth=1.1, shrinkA=0, shrinkB=0, zorder=1)
    )


def _draw_state(axes: Any, machine: Machine, layout: Layout, state: int, text: str) -> None:
    from matplotlib.patches import Circle

    accepts = machine.kind is Kind.DFA and bool(machine.state_outputs[state])
    colour, centre = _COLOURS[layout.ranks[state] % len(_COLOURS)], layout.centres[state]
    for radius_in in (layout.radius_in, layout.radius_in - _SECOND_RIM_IN)[: 1 + accepts]:
        axes.add_patch(Circle(centre, radius_in, facecolor="white", edgecolor=colour, linewidth=1.4, zorder=4))
    axes.text(*centre, text, ha="center", va="center", fontsize=_FONT_PT, zorder=5, parse_math=False)
