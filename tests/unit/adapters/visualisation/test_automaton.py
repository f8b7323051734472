import io
import random
import re

import numpy as np
import pytest
from matplotlib.image import imread

from palpate.adapters.visualisation.automaton import machine_picture
from palpate.core.automata.machine import Kind, Machine
from tests.unit.core.automata.machines import dfa, random_machine


def texts(svg: bytes) -> list[str]:
    return re.findall(r"<text[^>]*>([^<]*)</text>", svg.decode())


def test_states_symbols_and_title_stand_in_the_picture_as_text() -> None:
    machine = dfa([[1, 0], [2, 1], [0, 0]], [1], labels=("home", "away", "lost one"))
    found = texts(machine_picture(machine, "a title"))
    assert {"home", "away", "a title"} <= set(found)
    # Symbols on the way to the same state share an edge.
    assert "a, b" in found
    assert {"a", "b"} <= set(found)


def test_an_accepting_state_has_a_second_rim() -> None:
    rows = [[1, 0], [0, 1]]
    none, both = (machine_picture(dfa(rows, accepting)).decode() for accepting in ([], [0, 1]))
    circles = r"C \S+ \S+ \S+ \S+ \S+ \S+"
    assert len(re.findall(circles, both)) > len(re.findall(circles, none))


@pytest.mark.parametrize("name", ["$x^2$", "a<b", "tx- ty0", "&amp;", "Ä"])
def test_names_are_shown_as_they_are(name: str) -> None:
    machine = Machine(Kind.DFA, (name, "b"), ((0, 0),), (True,), labels=(name,))
    svg = machine_picture(machine, name).decode()
    shown = name.replace("&", "&amp;").replace("<", "&lt;")
    assert svg.count(shown) >= 2


@pytest.mark.parametrize("states", [1, 5, 30])
def test_nothing_is_drawn_at_the_very_edge(states: int) -> None:
    machine = random_machine(random.Random(states), Kind.MOORE, states, 6)
    picture = imread(io.BytesIO(machine_picture(machine, "", "png")))
    dark = np.argwhere(picture[:, :, :3].min(axis=2) < 0.9)
    assert len(dark) > 500
    height, width = picture.shape[:2]
    assert dark.min() > 0
    assert dark[:, 0].max() < height - 1
    assert dark[:, 1].max() < width - 1
