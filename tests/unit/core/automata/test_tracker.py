import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.automata import AutomatonState, Kind, Machine, Strings
from palpate.core.automata.tracker import LOST
from palpate.core.errors import ConfigurationError
from palpate.core.perception import stage_from_dict, stage_to_dict

ALPHABET = ("a", "b", "c")
COMPLETE = Machine(Kind.MOORE, ALPHABET, ((1, 2, 0), (1, 2, 3), (1, 0, 3), (3, 3, 3)), ("p", "q", "r", "s"))
PARTIAL = Machine(
    Kind.MOORE,
    ALPHABET,
    ((1, None, None), (None, 2, None), (1, 3, None), (1, None, None)),
    ("p", "q", "r", "s"),
    labels=("begin", "after a", "after ab", "after abb"),
)


def run(tracker, word):
    tracker.reset()
    return [tracker.states[tracker.update(tracker.symbols.index(name))] for name in word]


@given(st.lists(st.integers(0, 2), max_size=20))
def test_it_follows_a_complete_machine(word):
    tracker = AutomatonState.of(COMPLETE)
    tracker.reset()
    state = COMPLETE.start
    for symbol in word:
        state = COMPLETE.transitions[state][symbol]
        assert tracker.update(symbol) == state


def test_states_have_the_symbol_that_most_often_leads_into_them():
    a, b, c = range(3)
    assert AutomatonState.of(PARTIAL).symbol_of == (None, a, b, b, None)
    # Two lead into the first, from one state each; into the last all three, but c from most.
    assert AutomatonState.of(COMPLETE).symbol_of == (b, a, b, c, None)


def test_it_stays_lost_as_long_as_nothing_fits():
    # c leads nowhere, so nothing is believed after it.
    tracker = AutomatonState.of(PARTIAL)
    assert run(tracker, "accaab") == ["after a", LOST, LOST, LOST, LOST, "after ab"]


def test_strings_tell_what_is_known_and_what_is_usual():
    # No string takes c from the start, nor anything in s3; b leads to s2 once and to s0 three times.
    strings = Strings.of(["ab", "b", "bb", "abb", "abbabb"], alphabet=ALPHABET)
    tracker = AutomatonState.of(COMPLETE, strings)
    assert tracker.transitions == ((1, 2, None), (None, 2, None), (None, 0, None), (None, None, None))
    assert tracker.anchors == (1, 2, None)
    assert run(tracker, "aab") == ["s1", LOST, "s2"]
    all_known = AutomatonState.of(COMPLETE)
    assert all_known.transitions == COMPLETE.transitions
    assert all_known.anchors == (1, 2, 3)


@given(st.lists(st.integers(0, 2), max_size=12), st.lists(st.integers(0, 2), max_size=12))
def test_its_memory_goes_on_elsewhere(before, after):
    one, other = AutomatonState.of(PARTIAL), AutomatonState.of(PARTIAL)
    for symbol in before:
        one.update(symbol)
    other.set_state(json.loads(json.dumps(one.get_state())))
    assert [one.update(symbol) for symbol in after] == [other.update(symbol) for symbol in after]
    assert one.get_state() == other.get_state()


@pytest.mark.parametrize("state", [[0.0, 0.0, 0.0], [5.0, 0.0], [0.0, 3.0], [4.0, -1.0], [float("nan"), 0.0]])
def test_other_memories_are_refused_and_change_nothing(state):
    tracker = AutomatonState.of(PARTIAL)
    tracker.update(0)
    before = tracker.get_state()
    with pytest.raises(ConfigurationError, match=r"perception\.identifier\.state"):
        tracker.set_state(state)
    assert tracker.get_state() == before


def test_it_is_written_and_read_like_other_stages():
    tracker = AutomatonState.of(PARTIAL)
    data = json.loads(json.dumps(stage_to_dict(tracker), allow_nan=False))
    assert data["kind"] == "automaton"
    back = stage_from_dict(data)
    assert back == tracker
    assert stage_to_dict(back) == stage_to_dict(tracker)
    assert run(back, "aab") == run(tracker, "aab")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("automaton", ["x", "y", "z", LOST]),
        ("transitions", [[0, 0, 0]] * 3 + [[0, 0]]),
        ("transitions", [[0, 0, 4]] * 4),
        ("anchors", [0, 0, 4]),
        ("start", 4),
    ],
)
def test_bad_values_are_refused_by_name(key, value):
    data = stage_to_dict(AutomatonState.of(PARTIAL)) | {key: value}
    with pytest.raises(ConfigurationError, match=key):
        stage_from_dict(data, "perception.identifier")
