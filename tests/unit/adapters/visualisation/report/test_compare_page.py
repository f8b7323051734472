"""Strategies beside each other."""

from palpate.adapters.visualisation.report.compare_page import Strategy, strategies_picture


def test_each_strategy_has_its_line() -> None:
    strategies = [
        Strategy("torque", (1.0, 0.9, 1.0), (0.8, 0.5, 1.2), (4.0, 3.0, 6.0)),
        Strategy("random", (0.33, 0.1, 0.7), (20.0, 9.0, 20.0), (20.0, None, None)),
    ]
    two = strategies_picture("strategies", strategies, "caption")
    one = strategies_picture("strategies", strategies[:1], "caption")
    assert "torque: success 100 %, median 0.80 s, 95th percentile 4.00 s" in two.alt
    assert "random: success 33 %" in two.alt
    assert len(two.png) > len(one.png)
    assert strategies_picture("strategies", strategies, "caption") == two
