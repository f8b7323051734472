"""The contract suites can fail: each unsafe adapter breaks a clause, and that clause says so."""

import pytest

from palpate.adapters.contracts import TICK_NS, ClauseNotApplicable, ContractViolation
from tests.contracts.unsafe import ARM, CLOCK, ENCODER, FORCE, UNSAFE, Mirrors
from tests.fake_devices import FakeArm, FakeForceSensor

SUITES = (FORCE, ENCODER, ARM, CLOCK)


def clauses(suite):
    return [name for name in dir(suite) if name.startswith("test_")]


def failed(suite):
    """Return what each clause that fails says; a clause that does not apply does not fail."""
    messages = {}
    for clause in clauses(suite):
        try:
            getattr(suite, clause)()
        except ClauseNotApplicable:
            continue
        except Exception as error:
            messages[clause] = str(error)
    return messages


@pytest.mark.parametrize("number", range(len(UNSAFE)), ids=lambda k: UNSAFE[k][1].__name__)
def test_unsafe_adapter_fails_its_clause(number):
    suite, kind, name = UNSAFE[number]
    (clause,) = [one for one in clauses(suite) if one.startswith(f"test_{name}")]
    with pytest.raises(Exception, match=r".") as caught:
        getattr(suite.trying(kind), clause)()
    assert not isinstance(caught.value, ClauseNotApplicable)


def test_without_any_one_clause_something_gets_through():
    needed = set[str]()
    for suite, kind, name in UNSAFE:
        if not any(clause.startswith(f"test_{name}") for clause in needed):
            names = failed(suite.trying(kind)).keys()
            needed |= names if len(names) == 1 else set()
    assert {clause for suite in SUITES for clause in clauses(suite)} - needed == set()


def test_nothing_is_sent_to_an_arm_that_may_not_be_commanded():
    class Forbidden(FakeArm):
        def send(self, command):
            raise AssertionError(command)

    suite = ARM.trying(Forbidden)
    suite.may_command = False
    assert failed(suite) == {}


def test_violation_says_what_was_seen_and_what_is_wanted():
    suite = FORCE.trying(Mirrors)
    with pytest.raises(ContractViolation) as caught:
        suite.test_load_has_its_sign_axis_and_unit()
    assert str(caught.value) == (
        "load: observed a change of (-10.0, 0.0, 0.0); the contract wants (10.0, 0.0, 0.0) within 1e-06"
    )


def test_missing_knob_is_not_a_pass():
    suite = FORCE.trying(go_silent=None, push_N=None, disconnect=None, provoke_fault=None, is_open=None)
    with pytest.raises(ClauseNotApplicable, match=r"no go_silent: .* the device stop sending without an error"):
        suite.test_silence_is_marked()
    assert failed(suite) == {}


def test_sensor_slower_than_the_loop_keeps_the_contract():
    def every_third_tick(self):
        last = self._sample
        self.silent = last is not None and self.clock.now_ns() < last.source_time_ns + 3 * TICK_NS
        return FakeForceSensor.read(self)

    suite = FORCE.trying(type("Slow", (FakeForceSensor,), {"read": every_third_tick}), go_silent=None, settle_ticks=3)
    assert failed(suite) == {}
