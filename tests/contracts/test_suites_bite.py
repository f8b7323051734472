"""The contract suites can fail: each broken adapter beside this breaks one clause, and that clause says so.

Some clauses imply others (an arm that says nothing of a fault refuses nothing either), so a few broken
adapters are caught by more than one; what is listed is exactly what fails.
"""

import unittest
from threading import Event
from typing import Any

import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.ports import JointCommand
from palpate.core.ports.contracts import (
    Clause,
    ClauseNotApplicable,
    ClauseOutcome,
    ClockContract,
    ContractViolation,
    clauses,
    run_clauses,
)
from palpate.core.ports.contracts.running import _run

# As a module: a suite that is imported by name would be run here once more as it is.
from tests.contracts import test_fake as fake
from tests.contracts.broken_arms import ARMS, CAUSAL, CLOCKS, ENCODERS
from tests.contracts.broken_sensors import LIVES, SAMPLES, altered
from tests.contracts.unsafe_adapters import UNSAFE
from tests.fake_devices import FakeForceSensor

FORCE, ENCODER, ARM, CLOCK = SUITES = (
    fake.TestFakeForceSensor,
    fake.TestFakeJointEncoder,
    fake.TestFakeArm,
    fake.TestFakeClock,
)
# A cable that is plugged in again tries most of a life once more; what only that finds is among the unsafe ones.
CUT_FOR_GOOD: dict[str, Any] = {"reconnect": None}
CASES: list[tuple[Any, Any, dict[str, Any], set[str]]] = [
    *((FORCE, kind, knobs | CUT_FOR_GOOD, names) for kind, knobs, names in LIVES + SAMPLES),
    *((ENCODER, kind, knobs | CUT_FOR_GOOD, names) for kind, knobs, names in ENCODERS),
    *((ARM, kind, knobs | CUT_FOR_GOOD, names) for kind, knobs, names in ARMS),
    *((CLOCK, *case) for case in CLOCKS),
]


def failed(suite: object) -> dict[str, str]:
    return {r.clause.name: r.message for r in run_clauses(suite) if r.outcome is ClauseOutcome.FAILED}


@pytest.mark.parametrize("number", range(len(CASES)), ids=lambda k: CASES[k][1].__name__)
def test_a_broken_adapter_fails_exactly_the_intended_clauses(number: int) -> None:
    # That a sound one fails none is what test_fake.py shows.
    suite, broken, knobs, names = CASES[number]
    assert failed(suite.trying(broken, **knobs)).keys() == names


@pytest.mark.parametrize("number", range(len(UNSAFE)), ids=lambda k: UNSAFE[k][1].__name__)
def test_an_unsafe_adapter_is_caught_by_the_clause_that_should(number: int) -> None:
    suite, unsafe, knobs, name = UNSAFE[number]
    assert _run(suite.trying(unsafe, **knobs), Clause(name, "")).outcome is ClauseOutcome.FAILED


def test_without_any_one_clause_something_gets_through() -> None:
    everything = {clause.name for suite in SUITES for clause in clauses(suite)}
    needed = set[str]().union(*(names for *_, names in CASES if len(names) == 1))
    for suite, unsafe, knobs, name in UNSAFE:
        if name not in needed and failed(suite.trying(unsafe, **knobs)).keys() == {name}:
            needed.add(name)
    assert everything - needed == {"test_command_that_is_not_finite_cannot_be_made"}  # of no adapter; below


def test_an_adapter_that_blocks_for_ever_is_given_up() -> None:
    blocks = type("Blocks", (FakeForceSensor,), {"read": lambda self: Event().wait()})
    results = run_clauses(FORCE.trying(blocks), patience_s=0.3)
    failures = [result for result in results if result.outcome is ClauseOutcome.FAILED]
    assert ["blocks" in result.message for result in failures] == [True]


def test_a_command_of_nan_would_be_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(JointCommand, "__post_init__", lambda self: None)
    assert failed(ARM()).keys() == {"test_command_that_is_not_finite_cannot_be_made"}


def test_a_violation_says_what_was_seen_and_what_is_wanted() -> None:
    suite = FORCE.trying(altered(FakeForceSensor, force_N=lambda s: tuple(-f for f in s.force_N)))
    with pytest.raises(ContractViolation) as caught:
        suite.test_pressing_on_the_tip_gives_negative_fz()
    assert caught.value.clause == "sign"
    assert str(caught.value) == ("sign: observed Fz changed by +10.000 N; the contract wants a negative change of Fz")
    assert isinstance(caught.value, AssertionError)


def test_a_missing_knob_is_not_a_pass() -> None:
    suite = FORCE.trying(go_silent=None, push_N=None, disconnect=None, provoke_fault=None, is_open=None)
    outcomes = {r.clause.name: r for r in run_clauses(suite)}
    silence = outcomes["test_silence_is_not_passed_off_as_news"]
    assert silence.outcome is ClauseOutcome.NOT_APPLICABLE
    assert silence.message == "this rig has no go_silent"
    assert sum(r.outcome is ClauseOutcome.NOT_APPLICABLE for r in outcomes.values()) == 12
    assert all(r.outcome is not ClauseOutcome.FAILED for r in outcomes.values())
    assert issubclass(ClauseNotApplicable, unittest.SkipTest)  # which pytest shows as skipped


def test_a_world_that_runs_by_itself_may_have_news_at_any_time() -> None:
    def a_moment(self: Any) -> Any:
        self.clock.sleep_until(self.clock.now_ns() + 1)
        return FakeForceSensor.read(self)

    suite = FORCE.trying(type("Lively", (FakeForceSensor,), {"read": a_moment}), runs_by_itself=True)
    assert failed(suite) == {}
    outcomes = {r.clause.name: r.outcome for r in run_clauses(ENCODER.trying(runs_by_itself=True))}
    assert outcomes[next(iter(CAUSAL))] is ClauseOutcome.NOT_APPLICABLE


def test_a_rig_whose_clock_stands_still_is_told_so() -> None:
    silence = failed(FORCE.trying(advance=lambda ticks: None))["test_silence_is_not_passed_off_as_news"]
    assert "advance() to let time go on" in silence


def test_every_clause_states_itself_in_one_sentence() -> None:
    for suite in SUITES:
        for clause in clauses(suite):
            assert clause.statement.endswith("."), clause
            assert "\n" not in clause.statement, clause


def test_general_clauses_come_first() -> None:
    names = [clause.name for clause in clauses(ARM)]
    assert names[0] == "test_matches_the_port"
    assert names[-1] == "test_newest_command_wins"


def test_a_class_in_place_of_a_suite_is_refused_and_not_found_to_be_sound() -> None:
    with pytest.raises(ConfigurationError, match="an instance of a contract suite"):
        run_clauses(ClockContract)
