import math
from collections.abc import Sequence

import pytest

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception import IdentityState, Perception, SelectedChannels, Thresholds

BANDS = Thresholds.of({"x": (-1e-3, 1e-3), "tx": (-0.01, 0.01)})


class TwoInARow:
    """A state identifier with a memory: was this symbol there just before?"""

    def __init__(self, symbols: tuple[str, ...]) -> None:
        self.symbols = symbols
        self.states = ("new", "again")
        self._last = -1.0

    def reset(self) -> None:
        self._last = -1.0

    def update(self, symbol: int, action: str | None = None) -> int:
        again, self._last = symbol == self._last, symbol
        return int(again)

    def get_state(self) -> list[float]:
        return [self._last]

    def set_state(self, state: Sequence[float]) -> None:
        (self._last,) = state


def signal(x: float, tx: float) -> tuple[float, ...]:
    return (x, 9.0, 9.0, 9.0, 9.0, 9.0, tx, 9.0, 9.0)


def test_a_measurement_becomes_a_symbol_and_a_state() -> None:
    perception = Perception(SelectedChannels(("x", "tx")), BANDS, IdentityState(BANDS.symbols))
    symbol, state = perception.observe(signal(2e-3, -0.02))
    assert perception.symbols[symbol] == perception.states[state] == "x+ tx-"


def test_an_identifier_with_a_memory_fits_in() -> None:
    perception = Perception(SelectedChannels(("x", "tx")), BANDS, TwoInARow(BANDS.symbols))
    assert perception.states == ("new", "again")
    here, there = signal(0.0, 0.0), signal(1.0, 0.0)
    assert [perception.observe(s)[1] for s in (here, here, there, there)] == [0, 1, 0, 1]
    memory = perception.get_state()
    perception.reset()
    assert perception.observe(there)[1] == 0
    perception.observe(here)
    perception.set_state(memory)
    assert perception.observe(there)[1] == 1


def test_features_in_another_order_than_the_thresholds_are_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"symboliser\.features = \('x', 'tx'\) .* tx, x"):
        Perception(SelectedChannels(("tx", "x")), BANDS, IdentityState(BANDS.symbols))


def test_an_identifier_for_other_symbols_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"identifier\.symbols"):
        Perception(SelectedChannels(("x", "tx")), BANDS, IdentityState(("a", "b")))


def test_a_measurement_that_cannot_be_one_is_refused() -> None:
    perception = Perception(SelectedChannels(("x", "tx")), BANDS, IdentityState(BANDS.symbols))
    with pytest.raises(CommandError, match="9 channels"):
        perception.observe((0.0,) * 6)
    with pytest.raises(CommandError, match="finite"):
        perception.observe(signal(0.0, math.nan))
