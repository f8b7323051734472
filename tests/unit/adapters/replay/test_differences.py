"""How far numbers of a replay may be apart from the recorded ones."""

import pytest

from palpate.adapters.replay.differences import close_enough, same_bits


@pytest.mark.parametrize(
    ("a", "b", "close"),
    [(1.0, 1.0 + 1e-10, True), (1.0, 1.0 + 1e-8, False), (0.0, 1e-13, True), (0.0, 1e-9, False)],
)
def test_what_another_processor_may_do(a: float, b: float, close: bool) -> None:
    assert close_enough(a, b) is close


def test_bits_are_compared_not_values() -> None:
    nan = float("nan")
    assert same_bits((nan,), (nan,))
    assert not same_bits((0.0,), (-0.0,))
    assert not same_bits((0.0,), (0.0, 0.0))
