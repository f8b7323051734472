"""Pictures of machines: what is written in them, and where it lies."""

import io
import random
import re
from itertools import combinations
from math import dist, isclose

import numpy as np
import pytest
from matplotlib.image import imread

from palpate.adapters.visualisation.automaton import machine_picture
from palpate.adapters.visualisation.automaton_layout import lay_out
from palpate.core.automata import Kind, Machine, edges
from tests.unit.core.automata.machines import KINDS, dfa, random_machine

RADIUS_IN, LINE_IN = 0.3, 0.15


def test_states_symbols_and_title_are_text_in_the_picture():
    machine = dfa([[1, 0], [2, 1], [0, 0]], [1], labels=("home", "away", "lost one"))
    found = re.findall(r"<text[^>]*>([^<]*)</text>", machine_picture(machine, "a title").decode())
    # Symbols on the way to the same state share an edge.
    assert {"home", "away", "a title", "a, b", "a", "b"} <= set(found)


def test_accepting_state_has_a_second_rim():
    rows = [[1, 0], [0, 1]]
    none, both = (machine_picture(dfa(rows, accepting)).decode() for accepting in ([], [0, 1]))
    circles = r"C \S+ \S+ \S+ \S+ \S+ \S+"
    assert len(re.findall(circles, both)) > len(re.findall(circles, none))


@pytest.mark.parametrize("name", ["$x^2$", "a<b", "tx- ty0", "&amp;", "Ä"])
def test_names_are_shown_as_they_are(name):
    machine = Machine(Kind.DFA, (name, "b"), ((0, 0),), (True,), labels=(name,))
    svg = machine_picture(machine, name).decode()
    assert svg.count(name.replace("&", "&amp;").replace("<", "&lt;")) >= 2


@pytest.mark.parametrize("states", [1, 5, 30])
def test_nothing_is_drawn_at_the_very_edge(states):
    machine = random_machine(random.Random(states), Kind.MOORE, states, 6)
    picture = imread(io.BytesIO(machine_picture(machine, "", "png")))
    dark = np.argwhere(picture[:, :, :3].min(axis=2) < 0.9)
    assert len(dark) > 500
    assert dark.min() > 0
    assert (dark.max(axis=0) < np.array(picture.shape[:2]) - 1).all()


@pytest.mark.parametrize("states", [1, 2, 5, 30])
@pytest.mark.parametrize("kind", KINDS)
def test_circles_keep_apart_and_curves_go_from_rim_to_rim(kind, states):
    machine = random_machine(random.Random(states), kind, states, 6, missing=0.2)
    layout = lay_out(machine, RADIUS_IN, LINE_IN)
    assert sorted(layout.ranks) == list(range(states))
    assert layout.ranks[machine.start] == 0
    assert all(dist(one, other) > 2 * RADIUS_IN for one, other in combinations(layout.centres, 2))
    assert [curve.edge for curve in layout.curves] == list(edges(machine))
    for curve in layout.curves:
        assert isclose(dist(curve.points[0], layout.centres[curve.edge.source]), RADIUS_IN)
        assert isclose(dist(curve.points[3], layout.centres[curve.edge.target]), RADIUS_IN)
        # A label begins outside the circle that its edge leaves.
        assert dist(curve.label_at, layout.centres[curve.edge.source]) > RADIUS_IN
    tail, tip = layout.start
    assert isclose(dist(tip, layout.centres[machine.start]), RADIUS_IN)
    assert dist(tail, layout.centres[machine.start]) > RADIUS_IN


def test_edges_of_a_state_leave_apart_from_each_other():
    layout = lay_out(random_machine(random.Random(4), Kind.MOORE, 12, 6), RADIUS_IN, LINE_IN)
    for state in range(12):
        begins = [c.points[0] for c in layout.curves if c.edge.source == state and c.edge.target != state]
        assert all(dist(one, other) > 0.05 for one, other in combinations(begins, 2))
