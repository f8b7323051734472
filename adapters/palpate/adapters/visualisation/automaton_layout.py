"""Where the states and edges of a machine go in a picture.

States are on a circle, in the order in which they are reached. An edge leaves its state through a port of its own: the
ports of a state, for edges that leave as well as for those that arrive, keep a least distance, and the label of an edge
is right behind its port. So labels do not meet however many edges cross in the middle. Loops and the arrow of the
start are on the outside. All lengths are in inches, all angles in radians against the x axis.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, cos, dist, pi, sin, tau

import numpy as np

from palpate.core.automata import Edge, Machine, edges

Point = tuple[float, float]

_LEAST_CIRCLE_IN = 1.3
_PITCH_IN = 0.66
"""Between the rims of neighbours on the circle."""
_LEAN = 0.6
"""How far edges turn away from the centre, as a part of the direct way: less keeps clear of states in between."""
_BEND = 0.42
"""Length of the handles of a curve, as a part of the distance."""
_LABEL_GAP_IN = 0.09
_ARRIVING_IN = 0.09
_LOOP_IN = 0.62
_LOOP_OPENING = 0.42
_START_ANGLE = 0.85
_START_IN = 0.4
_MOST_TURN = 1.8 * pi


@dataclass(frozen=True, slots=True)
class Curve:
    """An edge as a cubic Bezier curve."""

    edge: Edge
    points: tuple[Point, Point, Point, Point]
    label_at: Point
    label_angle: float


@dataclass(frozen=True, slots=True)
class Layout:
    """Where everything is."""

    radius_in: float
    ranks: tuple[int, ...]
    centres: tuple[Point, ...]
    curves: tuple[Curve, ...]
    start: tuple[Point, Point]


def lay_out(machine: Machine, radius_in: float, line_in: float) -> Layout:
    """Place the states and edges of a machine; equal machines give equal layouts."""
    shown = edges(machine)
    ranks = _ranks(machine)
    count = len(ranks)
    # The start is on the left, and the others follow clockwise.
    outward = [pi - tau * rank / count for rank in ranks]
    circle_in = 0.0 if count == 1 else max(_LEAST_CIRCLE_IN, count * (2 * radius_in + _PITCH_IN) / tau)
    centres = tuple(_along((0.0, 0.0), angle, circle_in) for angle in outward)
    ports = _ports(shown, centres, outward, radius_in, line_in)
    curves = []
    for number, edge in enumerate(shown):
        if edge.source == edge.target:
            curves.append(_loop(edge, centres[edge.source], outward[edge.source], radius_in))
            continue
        leaving, arriving = ports[number, True], ports[number, False]
        begin, end = centres[edge.source], centres[edge.target]
        points = _bent(begin, leaving, end, arriving, radius_in, _BEND * dist(begin, end))
        curves.append(Curve(edge, points, _along(begin, leaving, radius_in + _LABEL_GAP_IN), leaving))
    angle = outward[machine.start] + _START_ANGLE
    tip = _along(centres[machine.start], angle, radius_in)
    return Layout(radius_in, ranks, centres, tuple(curves), (_along(tip, angle, _START_IN), tip))


def _ranks(machine: Machine) -> tuple[int, ...]:
    """Places on the circle: breadth first from the start, then the states that are not reached."""
    order = list(dict.fromkeys([*machine.reachable(), *range(len(machine.transitions))]))
    return tuple(order.index(state) for state in range(len(order)))


def _ports(
    shown: Sequence[Edge], centres: Sequence[Point], outward: Sequence[float], radius_in: float, line_in: float
) -> dict[tuple[int, bool], float]:
    """Angle of both ends of each edge at its states, by number of the edge and whether it leaves there."""
    ends: list[list[tuple[float, bool, int, float]]] = [[] for _ in centres]
    for number, edge in enumerate(shown):
        if edge.source != edge.target:
            for here, there, leaves in ((edge.source, edge.target, True), (edge.target, edge.source, False)):
                (x, y), (far_x, far_y) = centres[here], centres[there]
                turn = _wrapped(atan2(far_y - y, far_x - x) - outward[here] - pi)
                # Rounded, so that of two edges between the same states the one that leaves is on the same side always.
                width_in = line_in if leaves else _ARRIVING_IN
                ends[here].append((round(_LEAN * turn, 9), leaves, number, width_in))
    found = {}
    for here, wanted in enumerate(ends):
        wanted.sort()
        widths = [width_in / (radius_in + (_LABEL_GAP_IN if leaves else 0.0)) for _, leaves, _, width_in in wanted]
        turns = _spread([turn for turn, _, _, _ in wanted], widths)
        for turn, (_, leaves, number, _) in zip(turns, wanted, strict=True):
            found[number, leaves] = outward[here] + pi + turn
    return found


def _spread(wanted: Sequence[float], widths: Sequence[float]) -> list[float]:
    """Values as near as possible to the wanted ones, in their order, each as wide as given."""
    from scipy.optimize import isotonic_regression

    wide = np.array(widths) * min(1.0, _MOST_TURN / max(sum(widths), 1e-9))
    offsets = np.cumsum(wide) - wide / 2
    return (isotonic_regression(np.array(wanted) - offsets).x + offsets).tolist() if widths else []


def _loop(edge: Edge, centre: Point, outward: float, radius_in: float) -> Curve:
    one, other = outward - _LOOP_OPENING, outward + _LOOP_OPENING
    points = _bent(centre, one, centre, other, radius_in, _LOOP_IN)
    top_in = radius_in + 0.75 * _LOOP_IN
    return Curve(edge, points, _along(centre, outward, top_in + _LABEL_GAP_IN), outward)


def _bent(
    begin: Point, leaving: float, end: Point, arriving: float, radius_in: float, handle_in: float
) -> tuple[Point, Point, Point, Point]:
    """From rim to rim, at right angles to both."""
    return (
        _along(begin, leaving, radius_in),
        _along(begin, leaving, radius_in + handle_in),
        _along(end, arriving, radius_in + handle_in),
        _along(end, arriving, radius_in),
    )


def _along(origin: Point, angle: float, distance_in: float) -> Point:
    return origin[0] + distance_in * cos(angle), origin[1] + distance_in * sin(angle)


def _wrapped(angle: float) -> float:
    return (angle + pi) % tau - pi
