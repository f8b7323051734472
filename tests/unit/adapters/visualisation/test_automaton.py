"""Pictures of machines: what is written in them, and where it lies."""

import io
import random
import re

import numpy as np
import pytest
from matplotlib.image import imread

from palpate.adapters.visualisation.automaton import machine_picture
from palpate.core.automata import Kind
from tests.unit.core.automata.machines import dfa, random_machine


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


@pytest.mark.parametrize("states", [1, 5, 30])
def test_nothing_is_drawn_at_the_very_edge(states):
    machine = random_machine(random.Random(states), Kind.MOORE, states, 6)
    picture = imread(io.BytesIO(machine_picture(machine, "", "png")))
    dark = np.argwhere(picture[:, :, :3].min(axis=2) < 0.9)
    assert len(dark) > 500
    assert dark.min() > 0
    assert (dark.max(axis=0) < np.array(picture.shape[:2]) - 1).all()
