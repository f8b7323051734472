"""Policies over grid worlds."""

from palpate.adapters.visualisation.report.explore_page import grid_picture
from tests.unit.adapters.visualisation.report.samples import pixels, policy, row

MAP = ("AAB", "A·B", "#CC")


def test_it_tells_the_moves() -> None:
    document = policy(row("A", "+x"), row("B", "-x"), row("C", "+y", visits=0))
    picture = grid_picture("policy", document, MAP, "Policy of seed 0")
    assert "A: +x; B: -x." in picture.alt
    assert "C:" not in picture.alt
    assert picture.caption.startswith("Policy of seed 0.")


def test_a_move_up_points_up() -> None:
    def dark_rows(action: str) -> float:
        png = grid_picture("p", policy(row("A", action)), ("A",), "t").png
        dark = pixels(png).sum(axis=-1) < 60
        lines = dark.nonzero()[0]
        return float(lines.mean() - (lines.min() + lines.max()) / 2)

    assert dark_rows("+y") < -1 < 1 < dark_rows("-y")
