import random
from itertools import combinations
from math import hypot, isclose

import pytest

from palpate.adapters.visualisation.automaton_layout import Layout, lay_out
from palpate.core.automata import Kind, Machine, edges
from tests.unit.core.automata.machines import KINDS, dfa, random_machine

RADIUS_IN, LINE_IN = 0.3, 0.15


def layout_of(machine: Machine) -> Layout:
    return lay_out(machine, RADIUS_IN, LINE_IN)


def distance(one: tuple[float, float], other: tuple[float, float]) -> float:
    return hypot(one[0] - other[0], one[1] - other[1])


@pytest.mark.parametrize("states", [1, 2, 5, 30])
@pytest.mark.parametrize("kind", KINDS)
def test_circles_keep_apart_and_curves_go_from_rim_to_rim(kind: Kind, states: int) -> None:
    machine = random_machine(random.Random(states), kind, states, 6, missing=0.2)
    layout = layout_of(machine)
    assert len(layout.centres) == states
    assert all(distance(one, other) > 2 * RADIUS_IN for one, other in combinations(layout.centres, 2))
    assert [curve.edge for curve in layout.curves] == list(edges(machine))
    for curve in layout.curves:
        ends = (
            (curve.points[0], layout.centres[curve.edge.source]),
            (curve.points[3], layout.centres[curve.edge.target]),
        )
        assert all(isclose(distance(end, centre), RADIUS_IN) for end, centre in ends)
        # A label begins outside the circle that its edge leaves.
        assert distance(curve.label_at, layout.centres[curve.edge.source]) > RADIUS_IN


def test_edges_of_a_state_leave_apart_from_each_other() -> None:
    layout = layout_of(random_machine(random.Random(4), Kind.MOORE, 12, 6))
    for state in range(12):
        begins = [c.points[0] for c in layout.curves if c.edge.source == state and c.edge.target != state]
        assert all(distance(one, other) > 0.05 for one, other in combinations(begins, 2))


def test_every_state_has_a_place_of_its_own_and_the_start_an_arrow() -> None:
    machine = dfa([[1, 0], [2, 1], [0, 0]], [1], start=2)
    layout = layout_of(machine)
    assert sorted(layout.ranks) == [0, 1, 2]
    assert layout.ranks[2] == 0
    tail, tip = layout.start
    assert isclose(distance(tip, layout.centres[2]), RADIUS_IN)
    assert distance(tail, layout.centres[2]) > distance(tip, layout.centres[2])


def test_neighbours_in_the_machine_are_neighbours_on_the_circle() -> None:
    # A ring whose states are numbered criss-cross.
    order = [0, 5, 2, 7, 4, 1, 6, 3]
    after = dict(zip(order, [*order[1:], order[0]], strict=True))
    layout = layout_of(dfa([[after[state], None] for state in range(8)], []))
    for state, target in after.items():
        assert abs(layout.ranks[state] - layout.ranks[target]) in (1, 7)
