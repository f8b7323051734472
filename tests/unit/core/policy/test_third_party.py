"""Third-party policies: whatever they do, one typed error says what and whose fault it is."""

from itertools import count
from math import inf, nan
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.adapters.contracts import CONTEXT
from palpate.core.errors import ConfigurationError, PolicyError
from palpate.core.policy import (
    Action,
    Decision,
    EpisodeOutcome,
    PolicyDocument,
    ThirdPartyEntry,
    ThirdPartyPolicy,
    Transition,
    document_of,
    learner_of,
)
from tests.unit.core.policy.bench import OWN, Counting, Deciding, observation

ENTRY = ThirdPartyEntry("strange.module:Strange", "strange", "1.2", "", 0)
ACTIONS = CONTEXT.actions
SEEN = observation(0)


class MuteError(Exception):
    """One whose text fails."""

    def __str__(self):
        raise self


def wrapped(made, frozen=True):
    return ThirdPartyPolicy(made, ENTRY, CONTEXT, frozen=frozen)


def raising(error):
    def choose():
        raise error

    return choose


@pytest.mark.parametrize(
    ("gives", "said"),
    [
        (raising(ValueError("two\nlines")), "choose failed with ValueError: two lines"),
        (raising(MuteError()), "choose failed with MuteError: its text cannot be printed"),
        ("-x", "choose failed with AttributeError: 'str' object has no attribute 'action'"),
        (lambda: Decision(Action("far", (nan, 0.0)), None, "strange"), "two finite lengths in m"),
        (Decision(OWN, 3, "strange"), "'own' is not action 3; the action set has 8"),
        (Decision(ACTIONS[0], 8, "strange"), "'+x' is not action 8"),
        (Decision(Action("\udcff", (0.0, 0.0)), None, "strange"), "no log can show the action"),
        (Decision(OWN, None, 3), "choose failed with TypeError"),
    ],
)
def test_invalid_decision_is_fault_of_policy(gives, said):
    with pytest.raises(PolicyError) as caught:
        wrapped(Deciding(gives)).choose(SEEN)
    text = str(caught.value)
    assert said in text
    assert text.startswith("policy strange.module:Strange: ")
    assert text.endswith("; the fault is in the policy")
    assert "\n" not in text


def test_numbers_are_made_plain_and_actions_of_set_its_own():
    numbers = np.float64(1e-3), np.float32(0.5)
    given = wrapped(Deciding(Decision(Action("own", numbers), None, "strange"))).choose(SEEN)
    assert [type(value) for value in given.action.displacement_m] == [float, float]
    given = wrapped(Deciding(Decision(ACTIONS[2], np.int64(2), "strange"))).choose(SEEN)
    assert (given, type(given.index)) == (Decision(ACTIONS[2], 2, "strange"), int)


def test_slow_choice_by_clock_of_rig_ends_trial():
    slow = wrapped(Deciding())
    slow.now_ns = iter(range(0, 10**10, 10**9)).__next__
    with pytest.raises(PolicyError, match=r"choose took 1\.00 s; at most 0\.2 s on a rig"):
        slow.choose(SEEN)
    slow.now_ns = count(step=200_000_000).__next__
    assert slow.choose(SEEN).action == OWN


@pytest.mark.parametrize("name", ["serves", "begin_trial", "choose", "learn"])
def test_policy_without_method_is_refused(name):
    whole = Deciding()
    parts = {part: getattr(whole, part) for part in ("serves", "begin_trial", "choose", "learn") if part != name}
    with pytest.raises(ConfigurationError, match=f"SimpleNamespace lacks {name}"):
        wrapped(SimpleNamespace(**parts))


@pytest.mark.parametrize(("given", "shown"), [(None, None), (1, 1.0), (np.float32(0.5), 0.5)])
def test_temperature_is_number_or_none(given, shown):
    made = Deciding()
    made.temperature = given
    assert wrapped(made).temperature == shown
    made.temperature = inf
    with pytest.raises(PolicyError, match="temperature failed"):
        _ = wrapped(made).temperature


def test_policy_file_holds_state_which_only_its_code_can_take():
    made = wrapped(Counting(), frozen=False)
    assert learner_of(made) is made
    assert learner_of(wrapped(Deciding())) is None
    made.learn(Transition(0, 0, -1.0, None))
    made.end_trial(EpisodeOutcome(True, (0.0, 0.0, 0.0), 0.0))
    document = document_of(made, created_with={}, perception={})
    read = PolicyDocument.from_json_text(document.to_json_text())
    assert read == document
    assert (read.third_party.trials_learned, read.third_party.state) == (1, {"learned": 1})
    unlearned = read.unlearned().third_party
    assert (unlearned.trials_learned, unlearned.state) == (0, None)
    assert ThirdPartyPolicy(Counting(), read.third_party, CONTEXT, frozen=True).get_state() == made.get_state()
    with pytest.raises(PolicyError, match="set_state failed with AttributeError"):
        ThirdPartyPolicy(Deciding(), read.third_party, CONTEXT, frozen=True)


@pytest.mark.parametrize("state", [{"asked": nan}, {"asked": "\udcff"}, [1, 2]])
def test_state_that_no_file_can_hold_is_fault_of_policy(state):
    made = Counting()
    made.get_state = lambda: state
    learner = wrapped(made)
    with pytest.raises(PolicyError, match="get_state failed with"):
        learner.get_state()
