"""Policies that are not palpate's own: whatever they do, one typed error says what, and whose fault it is."""

import sys
from itertools import count
from math import inf, nan
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from palpate.core.errors import ConfigurationError, PolicyError
from palpate.core.policy.base import Action, Decision, Hindsight, Observation, Transition, compass_actions
from palpate.core.policy.file import PolicyDocument, document_of, learner_of
from palpate.core.policy.foreign import ForeignEntry, ForeignPolicy, PolicyContext
from palpate.core.policy.learner import Reach

ACTIONS = compass_actions(0.7e-3)
CONTEXT = PolicyContext(("left", "right"), ACTIONS, Reach(4e-3, 0.1))
ENTRY = ForeignEntry("strange.module:Strange", "strange", "1.2", "", 0)
SEEN = Observation(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0)
OWN = Action("own", (1e-3, 0.0))


class Strange:
    """Learns how often it was asked; derives from nothing of palpate's."""

    temperature: Any = None

    def __init__(self, gives: Any = None) -> None:
        self.gives, self.asked = Decision(OWN, None, "strange") if gives is None else gives, 0

    def serves(self, state: int) -> bool:
        return True

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        self.rng = rng

    def choose(self, observation: Observation) -> Any:
        self.asked += 1
        return self.gives() if callable(self.gives) else self.gives

    def learn(self, transition: Transition) -> None:
        self.asked += 1000


class StrangeLearner(Strange):
    def get_state(self) -> Any:
        return {"asked": self.asked}

    def set_state(self, state: Any) -> None:
        self.asked = state["asked"]


class MuteError(Exception):
    """One whose text fails."""

    def __str__(self) -> str:
        raise self


def policy(made: Any, frozen: bool = True) -> ForeignPolicy:
    return ForeignPolicy(made, ENTRY, CONTEXT, frozen=frozen)


def raising(error: BaseException) -> Any:
    def choose() -> None:
        raise error

    return choose


@pytest.mark.parametrize(
    ("gives", "said"),
    [
        (raising(ValueError("two\nlines")), "choose failed with ValueError: two lines"),
        (raising(SystemExit("bye")), "choose failed with SystemExit: bye"),
        (raising(MuteError()), "choose failed with MuteError: its text cannot be printed"),
        ("-x", "choose failed with AttributeError: 'str' object has no attribute 'action'"),
        (lambda: Decision(Action("far", (nan, 0.0)), None, "strange"), "two finite lengths in m"),
        (lambda: Decision(Action("far", (0.0, 0.0, 0.0)), None, "strange"), "too many values"),  # type: ignore[arg-type]
        (Decision(OWN, 3, "strange"), "'own' is not action 3; the action set has 8"),
        (Decision(ACTIONS[0], 8, "strange"), "'+x' is not action 8"),
        (Decision(ACTIONS[0], -8, "strange"), "'+x' is not action -8"),
        (Decision(Action("\udcff", (0.0, 0.0)), None, "strange"), "no log can show the action"),
        (Decision(OWN, None, 3), "choose failed with TypeError"),  # type: ignore[arg-type]
    ],
)
def test_what_makes_no_sense_is_the_policy_s_fault(gives: Any, said: str) -> None:
    with pytest.raises(PolicyError) as caught:
        policy(Strange(gives)).choose(SEEN)
    text = str(caught.value)
    assert said in text
    assert text.startswith("policy strange.module:Strange: ")
    assert text.endswith("; the fault is the policy's own")
    assert "\n" not in text


def test_numbers_are_made_plain_and_actions_of_the_set_its_own() -> None:
    numbers = np.float64(1e-3), np.float32(0.5)
    given = policy(Strange(Decision(Action("own", numbers), None, "strange"))).choose(SEEN)  # type: ignore[arg-type]
    assert [type(value) for value in given.action.displacement_m] == [float, float]
    given = policy(Strange(Decision(ACTIONS[2], np.int64(2), "strange"))).choose(SEEN)  # type: ignore[arg-type]
    assert given.index is not None
    assert given == Decision(ACTIONS[2], 2, "strange")


def test_a_choice_that_takes_too_long_by_the_rig_s_clock_ends_the_trial() -> None:
    slow = policy(Strange())
    slow.now_ns = iter(range(0, 10**10, 10**9)).__next__
    with pytest.raises(PolicyError, match=r"choose took 1\.00 s; at most 0\.2 s on a rig"):
        slow.choose(SEEN)
    slow.now_ns = count(step=200_000_000).__next__
    assert slow.choose(SEEN).action == OWN


@pytest.mark.parametrize("name", ["serves", "begin_trial", "choose", "learn"])
def test_what_lacks_a_method_is_no_policy(name: str) -> None:
    whole = Strange()
    parts = {part: getattr(whole, part) for part in ("serves", "begin_trial", "choose", "learn")}
    del parts[name]
    with pytest.raises(
        ConfigurationError, match=rf"'strange\.module:Strange' is refused: .*SimpleNamespace lacks {name}"
    ):
        policy(SimpleNamespace(**parts))


@pytest.mark.parametrize(("given", "shown"), [(None, None), (1, 1.0), (np.float32(0.5), 0.5)])
def test_temperature(given: Any, shown: float | None) -> None:
    made = Strange()
    made.temperature = given
    assert policy(made).temperature == shown
    made.temperature = inf
    with pytest.raises(PolicyError, match="temperature failed"):
        _ = policy(made).temperature


def test_a_learner_keeps_its_state_in_a_policy_file_and_a_frozen_one_is_not_taught() -> None:
    made = policy(StrangeLearner(), frozen=False)
    assert learner_of(made) is made
    made.begin_trial(0, np.random.default_rng(0))
    made.choose(SEEN)
    made.learn(Transition(0, 0, -1.0, None))
    made.end_trial(Hindsight(True, (0.0, 0.0, 0.0), 0.0))
    assert made.get_state() == {"trials_learned": 1, "state": {"asked": 1001}}
    document = document_of(made, created_with={}, perception={})
    read = PolicyDocument.from_json_text(document.to_json_text())
    assert read == document
    assert read.foreign is not None
    assert (read.foreign.trials_learned, read.foreign.state) == (1, {"asked": 1001})
    unlearned = read.unlearned().foreign
    assert unlearned is not None
    assert (unlearned.trials_learned, unlearned.state) == (0, None)
    again = ForeignPolicy(StrangeLearner(), read.foreign, CONTEXT, frozen=True)
    again.learn(Transition(0, 0, -1.0, None))
    again.end_trial(Hindsight(True, (0.0, 0.0, 0.0), 0.0))
    assert again.get_state() == made.get_state()
    with pytest.raises(PolicyError, match="set_state failed with AttributeError"):
        ForeignPolicy(Strange(), read.foreign, CONTEXT, frozen=True)


@pytest.mark.parametrize("state", [{"asked": nan}, {"asked": object()}, {"asked": "\udcff"}, [1, 2], sys])
def test_a_state_that_no_file_can_hold(state: Any) -> None:
    made = StrangeLearner()
    made.get_state = lambda: state  # type: ignore[method-assign]
    learner = policy(made)
    with pytest.raises(PolicyError, match="get_state failed with"):
        learner.get_state()
