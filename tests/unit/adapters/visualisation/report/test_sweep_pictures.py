"""Success and time against a setting."""

import numpy as np

from palpate.adapters.visualisation.report.canvas import COLOURS
from palpate.adapters.visualisation.report.sweep_pictures import Point, SweepSeries, sweep_picture
from tests.unit.adapters.visualisation.report.samples import pixels


def coloured(png: bytes, colour: str) -> np.ndarray:
    """Columns of the pixels of a colour."""
    wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    return np.nonzero(np.abs(pixels(png) - wanted).max(axis=-1) <= 3)[1]


def test_what_is_told() -> None:
    series = [
        SweepSeries("q-learning", (Point(0.5, (2.0, 4.0), 9, 10), Point(0.7, (1.0, 1.5), 10, 10))),
        SweepSeries("torque", (Point(0.5, (0.75,), 4, 4), Point(0.7, (0.5,), 2, 4))),
    ]
    picture = sweep_picture("task.step_mm", [0.5, 0.7], series)
    assert picture.name == "sweep-task.step-mm"
    assert "q-learning: 0.5: 3.00 s, 90 % success; 0.7: 1.25 s, 100 % success" in picture.alt
    assert "torque: 0.5: 0.75 s, 100 % success; 0.7: 0.50 s, 50 % success" in picture.alt
    for colour in COLOURS[:2]:
        assert len(coloured(picture.png, colour)) > 300


def test_numbers_lie_where_they_belong_and_names_side_by_side() -> None:
    # A point that has no neighbours does not say where it is: the ends fix the axis.
    def place(values: list[float] | list[str]) -> float:
        points = [Point(value, (1.0,), 1, 1) for value in values]
        lone = SweepSeries("a", (points[1],))
        ends = SweepSeries("b", (points[0], points[-1]))
        png = sweep_picture("f", values, [ends, lone]).png
        low, high = (f(coloured(png, COLOURS[0])) for f in (np.min, np.max))
        marks = coloured(png, COLOURS[1])
        return float((np.median(marks) - low) / (high - low))

    assert place([0.0, 1.0, 10.0]) < place(["a", "b", "c"])


def test_a_line_joins_numbers_and_not_names() -> None:
    def longest_gap(values: list[float] | list[str]) -> int:
        points = tuple(Point(value, (1.0,), 1, 1) for value in values)
        columns = np.unique(coloured(sweep_picture("f", values, [SweepSeries("a", points)]).png, COLOURS[0]))
        return int(np.diff(columns).max())

    # The legend's mark is apart from the others either way.
    assert longest_gap([0.0, 1.0]) < 100
    assert longest_gap(["a", "b"]) > 300
