"""Where a state was little tried its symbol decides, in the end the state; without a memory nothing changes."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState, LastSymbols
from palpate.core.policy.back_off import BackingOff, BackOff
from palpate.core.policy.base import Transition
from palpate.core.policy.conversion import document_of, new_learner, policy_from
from palpate.core.policy.exploration import TemperatureSchedule
from palpate.core.policy.file import PolicyDocument
from palpate.core.policy.sarsa import SarsaParameters
from palpate.core.policy.tabular import QLearning, QParameters
from tests.unit.core.policy.bench import TWO, refuse

STATES = ("a", "x > a", "y > a", "b")
SYMBOL_OF = (0, 0, 0, 1)
SETTINGS = {"alpha": 0.5, "gamma": 1.0, "temperature": TemperatureSchedule(1.0, 0.9, 0.1)}
PARAMETERS = QParameters(**SETTINGS)
transitions = st.builds(
    Transition,
    st.integers(0, 3),
    st.integers(0, 1),
    st.floats(-9.0, 0.0),
    st.none() | st.integers(0, 3),
    st.none() | st.integers(0, 1),
)


def learner(visits: float = 4.0, parameters: QParameters = PARAMETERS, **settings) -> BackingOff:
    back_off = BackOff.of(visits, SYMBOL_OF)
    assert back_off is not None
    return BackingOff(STATES, TWO, parameters, back_off, **settings)


def test_what_one_state_learns_its_sisters_expect_and_others_do_not():
    q = learner()
    q.learn(Transition(1, 0, -3.0, None))
    # The symbol's Q: (1 - .5) * 0 + .5 * -3; its own: -3, and one visit against four.
    assert q.q == ((-1.5, 0.0), ((1 * -3.0 + 4 * -1.5) / 5, 0.0), (-1.5, 0.0), (0.0, 0.0))
    assert q.visits == ((0, 0), (1, 0), (0, 0), (0, 0))


def test_the_next_state_is_worth_what_it_and_its_symbol_know():
    q = learner()
    q.learn(Transition(1, 0, -3.0, None))
    q.learn(Transition(1, 1, -2.0, None))
    q.learn(Transition(3, 0, -1.0, 2))
    assert q.q[3][0] == 0.5 * (-1.0 + max(-1.5, -1.0))
    q.learn(Transition(3, 1, -1.0, 2, next_action_index=0))
    assert q.q[3][1] == 0.5 * (-1.0 - 1.5)


@given(st.lists(transitions, max_size=40))
def test_a_symbol_of_one_state_alone_changes_nothing(seen):
    q, plain = learner(), QLearning(STATES, TWO, PARAMETERS)
    for step in seen:
        for one in (q, plain):
            one.learn(step if step.state == 3 else Transition(3, step.action_index, step.reinforcement, 3))
    assert q.q[3] == plain.q[3]


def test_without_a_memory_there_is_nothing_to_back_off_to():
    assert BackOff.of(20.0, IdentityState(("a", "b")).symbol_of) is None
    assert BackOff.of(0.0, LastSymbols(("a", "b"), 2).symbol_of) is None
    assert BackOff.of(20.0, LastSymbols(("a", "b"), 2).symbol_of) == BackOff(20.0, (0, 1, 0, 1, 0, 1))
    assert BackOff.of(20.0, (None, 2, 2, 0)) == BackOff(20.0, (None, 2, 2, None))
    assert type(new_learner(PARAMETERS, STATES, TWO)) is QLearning


@given(st.lists(transitions, max_size=60), st.lists(transitions, max_size=30))
def test_a_file_and_a_checkpoint_keep_every_bit(before, after):
    q = learner()
    for step in before:
        q.learn(step)
    document = document_of(q, created_with={}, perception={})
    read = PolicyDocument.from_json_text(document.to_json_text())
    assert read == document
    assert [row.q for row in read.table] == list(q.q)
    again, resumed = policy_from(read, STATES, TWO, frozen=False), learner()
    resumed.set_state(json.loads(json.dumps(q.get_state())))
    assert isinstance(again, BackingOff)
    for one in (q, again, resumed):
        one.begin_trial(1, np.random.default_rng(0))
        for step in after:
            one.learn(step)
    assert q.q == again.q == resumed.q
    assert q.get_state() == again.get_state() == resumed.get_state()


def test_unlearned_it_knows_nothing():
    q = learner()
    q.learn(Transition(1, 0, -3.0, None))
    blank = document_of(q, created_with={}, perception={}).unlearned()
    assert policy_from(blank, STATES, TWO, frozen=False).get_state() == learner().get_state()
    assert PolicyDocument.from_json_text(blank.to_json_text()) == blank


def learned_file():
    q = learner()
    q.learn(Transition(1, 0, -3.0, None))
    return json.loads(document_of(q, created_with={}, perception={}).to_json_text())


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"visits": 5.0}, r"table\[1\]\.q"),
        ({"visits": 0.0}, r"learner\.back_off\.visits"),
        ({"visits": "4"}, r"learner\.back_off\.visits"),
        ({"symbol_of": [0, 0, 0]}, r"learner\.back_off\.symbol_of"),
        ({"symbol_of": [0, 0, None, None]}, r"table\[2\]\.q"),
        ({"symbol_of": [0, 0, -1, None]}, r"learner\.back_off\.symbol_of\[2\]"),
        ({"state_q": [[0.0, 0.0]] * 4}, r"table\[1\]\.q"),
        ({"state_q": [[0.0, 0.0]] * 3}, r"learner\.back_off\.state_q"),
        ({"symbol_q": [[0.0]]}, r"learner\.back_off\.symbol_q"),
        ({"symbol_q": 7}, r"learner\.back_off\.symbol_q"),
        ({"symbol_visits": [[-1, 0]]}, r"learner\.back_off\.symbol_visits\[0\]"),
        ({"more": 1}, r"unknown key 'more'"),
    ],
)
def test_a_file_that_contradicts_itself_is_refused(change, says):
    content = learned_file()
    content["learner"]["back_off"] |= change
    with pytest.raises(ConfigurationError, match=says):
        PolicyDocument.from_json_text(json.dumps(content))


def test_sarsa_does_not_back_off():
    back_off = BackOff.of(4.0, SYMBOL_OF)
    refuse("policy.back_off", new_learner, SarsaParameters(**SETTINGS), STATES, TWO, back_off=back_off)
    content = learned_file()
    content["learner"] |= {"kind": "sarsa", "trace_decay": 0.5}
    with pytest.raises(ConfigurationError, match="unknown key 'back_off'"):
        PolicyDocument.from_json_text(json.dumps(content))


def test_each_state_has_a_symbol_or_none():
    with pytest.raises(ConfigurationError, match="4, one a state"):
        BackingOff(STATES, TWO, PARAMETERS, BackOff(1.0, (0, 0)))
    refuse("policy.back_off.symbol_of[1]", BackOff, 1.0, (0, -1))


@pytest.mark.parametrize("key", ["symbol_q", "symbol_visits"])
def test_a_state_of_another_size_is_refused_and_nothing_is_changed(key):
    q = learner()
    q.learn(Transition(1, 0, -3.0, None))
    before = q.get_state()
    refuse(f"learner.{key}", q.set_state, before | {key: [[0.0]], "q": [[9.0, 9.0]] * 4})
    assert q.get_state() == before
