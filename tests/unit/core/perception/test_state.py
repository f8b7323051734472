import pytest

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception.state import IdentityState, StateIdentifier


def test_the_state_is_the_last_symbol_whatever_came_before() -> None:
    identifier = IdentityState(("a", "b", "c"))
    assert identifier.states == ("a", "b", "c")
    assert identifier.symbol_of == (0, 1, 2)
    assert [identifier.update(symbol) for symbol in (2, 0, 0, 1, 2)] == [2, 0, 0, 1, 2]
    identifier.reset()
    assert identifier.update(1) == 1
    assert isinstance(identifier, StateIdentifier)


@pytest.mark.parametrize("symbol", [-1, 3])
def test_an_unknown_symbol_is_refused(symbol: int) -> None:
    with pytest.raises(CommandError, match=f"from 0 to 2: {symbol}"):
        IdentityState(("a", "b", "c")).update(symbol)


def test_its_memory_is_empty() -> None:
    identifier = IdentityState(("a", "b"))
    identifier.set_state(identifier.get_state())
    with pytest.raises(ConfigurationError, match=r"perception\.identifier\.state"):
        identifier.set_state([1.0])


def test_names_are_needed() -> None:
    with pytest.raises(ConfigurationError, match=r"perception\.identifier\.symbols"):
        IdentityState(())
