import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception import (
    IdentityState,
    LastAction,
    LastSymbols,
    StateIdentifier,
    stage_from_dict,
    stage_to_dict,
)

AB = ("a", "b")


def test_without_a_memory_the_state_is_the_last_symbol_whatever_came_before() -> None:
    identifier = IdentityState(("a", "b", "c"))
    assert identifier.states == ("a", "b", "c")
    assert [identifier.update(symbol) for symbol in (2, 0, 0, 1, 2)] == [2, 0, 0, 1, 2]
    identifier.reset()
    assert identifier.update(1) == 1
    assert isinstance(identifier, StateIdentifier)


@pytest.mark.parametrize("symbol", [-1, 3])
def test_an_unknown_symbol_is_refused_without_a_memory(symbol: int) -> None:
    with pytest.raises(CommandError, match=f"from 0 to 2: {symbol}"):
        IdentityState(("a", "b", "c")).update(symbol)


def test_a_trial_begins_with_nothing() -> None:
    identifier = LastSymbols(AB, 3)
    for symbol in (0, 1, 1):
        identifier.update(symbol)
    identifier.reset()
    assert identifier.states[identifier.update(1)] == "b"


@given(st.integers(1, 4), st.integers(1, 3), st.lists(st.integers(0, 3), max_size=12))
def test_the_name_of_the_state_tells_the_symbols(count: int, length: int, word: list[int]) -> None:
    names = "abcd"[:count]
    identifier = LastSymbols(tuple(names), length)
    assert len(identifier.states) == sum(count**size for size in range(1, length + 1))
    past: list[str] = []
    for symbol in word:
        past.append(names[symbol % count])
        state = identifier.update(symbol % count)
        assert identifier.states[state] == " > ".join(past[-length:])


@given(st.lists(st.integers(0, 1), max_size=6), st.integers(0, 1))
def test_it_goes_on_where_its_memory_was_kept(word: list[int], after: int) -> None:
    first, second = LastSymbols(AB, 3), LastSymbols(AB, 3)
    for symbol in word:
        first.update(symbol)
    second.set_state(json.loads(json.dumps(first.get_state())))
    assert first.update(after) == second.update(after)


@pytest.mark.parametrize("memory", [[0.0, 1.0, 1.0], [2.0], [-1.0], [0.5], [float("nan")]])
def test_another_memory_is_refused(memory: list[float]) -> None:
    identifier = LastSymbols(AB, 2)
    identifier.update(1)
    with pytest.raises(ConfigurationError, match=r"identifier\.state .* at most 2 whole numbers from 0 to 1"):
        identifier.set_state(memory)
    assert identifier.get_state() == [1.0]


@pytest.mark.parametrize("symbol", [-1, 2])
def test_an_unknown_symbol_is_refused(symbol: int) -> None:
    with pytest.raises(CommandError, match=f"from 0 to 1: {symbol}"):
        LastSymbols(AB, 2).update(symbol)


@pytest.mark.parametrize(
    ("symbols", "length", "says"),
    [
        ((), 2, "symbols"),
        (("a", "a"), 2, "symbols"),
        (AB, 0, "length"),
        (AB, 1.5, "length"),
        (AB, 17, "at most 100000 states; with 2 symbols there are 262142"),
        (("a", "a > a"), 2, "states"),
    ],
)
def test_what_makes_no_states_is_refused(symbols: tuple[str, ...], length: int, says: str) -> None:
    with pytest.raises(ConfigurationError, match=says):
        LastSymbols(symbols, length)


def test_it_comes_back_from_a_file() -> None:
    identifier = LastSymbols(AB, 3)
    back = stage_from_dict(json.loads(json.dumps(stage_to_dict(identifier))))
    assert stage_to_dict(identifier) == {"kind": "last_symbols", "symbols": ["a", "b"], "length": 3}
    assert back == identifier
    assert back.states == identifier.states


def test_a_state_can_be_the_last_symbol_and_the_kind_of_action_before_it() -> None:
    last = LastAction(("A", "B"), ("push", "lean"))
    assert last.states == ("A at first", "B at first", "A after push", "B after push", "A after lean", "B after lean")
    led = [(0, None), (1, "push 1"), (0, "lean 1"), (1, "another")]
    assert [last.states[last.update(symbol, action)] for symbol, action in led] == [
        "A at first", "B after push", "A after lean", "B at first",
    ]  # fmt: skip
    last.set_state(last.get_state())
    with pytest.raises(CommandError):
        last.update(2)
    with pytest.raises(ConfigurationError):
        last.set_state([1.0])
