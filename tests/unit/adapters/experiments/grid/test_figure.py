"""The picture: all panels, both kinds of file, equal bytes from equal runs."""

from __future__ import annotations

import re

import pytest

from palpate.adapters.experiments.grid.figure import Panel, learning_figure
from palpate.adapters.experiments.grid.worlds import Bounds

CURVES = tuple(tuple(50 - trial // 4 + run for trial in range(150)) for run in range(3))
PANELS = [
    [Panel(f"scenario {row}, {kind}", CURVES, Bounds(2.33, 3.2, 48.3)) for kind in ("symbols", "automaton")]
    for row in (1, 2)
]


def test_a_png_and_the_same_again() -> None:
    picture = learning_figure(PANELS, "png")
    assert picture.startswith(b"\x89PNG")
    assert picture == learning_figure(PANELS, "png")


def test_an_svg_has_every_curve_and_is_the_same_again() -> None:
    text = learning_figure(PANELS, "svg").decode()
    assert text == learning_figure(PANELS, "svg").decode()
    assert "<dc:date>" not in text
    for colour in ("#0072b2", "#d55e00", "#009e73"):
        assert len(re.findall(f"stroke: {colour}", text)) == 4


@pytest.mark.parametrize("belief", [None, 3.0])
def test_one_panel_alone(belief: float | None) -> None:
    assert learning_figure([[Panel("alone", CURVES[:1], Bounds(1.0, belief, 9.0))]], "png")
