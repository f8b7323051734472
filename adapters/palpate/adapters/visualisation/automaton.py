"""Pictures of machines. Matplotlib is imported only when one is drawn."""

import textwrap
from math import atan2, cos, degrees, dist, pi, sin, tau
from typing import Any, Final, Literal

from palpate.adapters.log import drawing
from palpate.core.automata import Kind, Machine, edges, shown_name, shown_output

_FONT_PT: Final = 9.0
_LETTER_IN: Final = 0.62 * _FONT_PT / 72  # a wide letter of the usual sans serif
_NAME_LETTERS: Final = 12
_LOOP_OPENING: Final = 0.42
_START_ANGLE: Final = 0.85
_LABEL_IN: Final = 0.16
"""From the rim of a state to the label of an edge that leaves it; every other label is further away by its height."""
# Dark enough to be read as text, and unlike for neighbours; an edge has the colour of the state that it leaves.
_COLOURS: Final = (
    "#1f5fa8", "#b8430f", "#257a2c", "#a3232b", "#6a3d9a", "#7a5200", "#b0287f", "#3f4f5f", "#00788a", "#5b6b00",
)  # fmt: skip
_Point = tuple[float, float]


def machine_picture(machine: Machine, title: str = "", file_format: Literal["svg", "png", "pdf"] = "svg") -> bytes:
    """Draw states on a circle, in the order in which they are reached, those that accept with a double rim.

    Edges have their symbols as labels, and the colour of the state that they leave. Equal machines and titles give
    equal bytes. Graphviz draws machines with more than some 20 states better, from their DOT file.
    """
    texts = [_text(machine, state) for state in range(len(machine.transitions))]
    ranks = {state: rank for rank, state in enumerate(dict.fromkeys([*machine.reachable(), *range(len(texts))]))}
    radius_in = 0.08 + max(0.2, *(_LETTER_IN / 2 * max(map(len, text.split("\n"))) for text in texts))
    circle_in = 0.0 if len(texts) == 1 else max(1.3, len(texts) * (2 * radius_in + 0.66) / tau)
    # The start is on the left, and the others follow clockwise.
    outward = {state: pi - tau * rank / len(texts) for state, rank in ranks.items()}
    centres = {state: _along((0.0, 0.0), angle, circle_in) for state, angle in outward.items()}
    shown = edges(machine)
    reach_in = circle_in + radius_in + 0.8 + _LETTER_IN * max((len(edge.label) for edge in shown), default=0)
    with drawing(2 * reach_in, 2 * reach_in, 110, file_format, {"svg.fonttype": "none"}, layout=None) as canvas:
        axes: Any = canvas.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(-reach_in, reach_in), ylim=(-reach_in, reach_in), aspect="equal")
        axes.axis("off")
        for number, edge in enumerate(shown):
            begin, end, angle = centres[edge.source], centres[edge.target], outward[edge.source]
            colour, far_in = _COLOURS[ranks[edge.source] % len(_COLOURS)], _LABEL_IN * (1 + number % 2)
            if edge.source == edge.target:
                tail, head = (_along(begin, angle + turn, radius_in) for turn in (-_LOOP_OPENING, _LOOP_OPENING))
                _arrow(axes, tail, head, colour, 2.5)
                far_in = 0.4
            else:
                # To the left of the direct way, so that two edges between the same states keep apart.
                angle = atan2(end[1] - begin[1], end[0] - begin[0])
                tail, head = _along(begin, angle - 0.3, radius_in), _along(end, angle + pi + 0.3, radius_in)
                _arrow(axes, tail, head, colour, 0.15)
                angle -= 0.3
                far_in = min(far_in, 0.3 * dist(tail, head))
            _label(axes, _along(begin, angle, radius_in + far_in), angle, edge.label, colour)
        tip = _along(centres[machine.start], outward[machine.start] + _START_ANGLE, radius_in)
        _arrow(axes, _along(tip, outward[machine.start] + _START_ANGLE, 0.4), tip, "black", 0.0)
        for state, text in enumerate(texts):
            accepts = machine.kind is Kind.DFA and bool(machine.state_outputs[state])
            _circles(axes, centres[state], radius_in, _COLOURS[ranks[state] % len(_COLOURS)], 1 + accepts)
            axes.text(*centres[state], text, ha="center", va="center", fontsize=_FONT_PT, zorder=5, parse_math=False)
        axes.text(0.1 - reach_in, reach_in - 0.1, title, va="top", fontsize=11.0, parse_math=False)
    return canvas.content


def _text(machine: Machine, state: int) -> str:
    lines = textwrap.wrap(shown_name(machine.names[state]), _NAME_LETTERS)
    if machine.kind is Kind.MOORE:
        lines += textwrap.wrap(shown_output(machine.state_outputs[state]), _NAME_LETTERS)
    return "\n".join(lines)


def _along(origin: _Point, angle: float, distance_in: float) -> _Point:
    return origin[0] + distance_in * cos(angle), origin[1] + distance_in * sin(angle)


def _arrow(axes: Any, tail: _Point, head: _Point, colour: str, bend: float) -> None:
    from matplotlib.patches import FancyArrowPatch

    way: Any = {"arrowstyle": "-|>,head_length=8,head_width=2.8", "connectionstyle": f"arc3,rad={bend}"}
    axes.add_patch(FancyArrowPatch(tail, head, **way, color=colour, linewidth=1.1, shrinkA=0, shrinkB=0, zorder=1))


def _label(axes: Any, place: _Point, angle: float, text: str, colour: str) -> None:
    leftwards = cos(angle) < -1e-9
    axes.text(
        *place, text, color=colour, fontsize=_FONT_PT, rotation=degrees(angle) + (180.0 if leftwards else 0.0),
        rotation_mode="anchor", ha="right" if leftwards else "left", va="center_baseline", zorder=3, parse_math=False,
        bbox={"boxstyle": "square,pad=0.08", "facecolor": "white", "edgecolor": "none"},
    )  # fmt: skip


def _circles(axes: Any, centre: _Point, radius_in: float, colour: str, count: int) -> None:
    from matplotlib.patches import Circle

    for number in range(count):
        style: Any = {"facecolor": "white", "edgecolor": colour, "linewidth": 1.4, "zorder": 4}
        axes.add_patch(Circle(centre, radius_in - 0.045 * number, **style))
