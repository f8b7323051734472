"""The contract suites can fail: each broken adapter here breaks one clause, and that clause says so.

Some clauses imply others (an arm that says nothing of a fault refuses nothing either), so a few broken
adapters are caught by more than one; what is listed is exactly what fails.
"""

from __future__ import annotations

import unittest
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.ports.contracts import (
    ClauseNotApplicable,
    ClauseOutcome,
    ClockContract,
    ContractViolation,
    clauses,
    run_clauses,
)
from palpate.core.ports.contracts.fakes import (
    TICK_NS,
    FakeArm,
    FakeClock,
    FakeForceSensor,
    FakeJointEncoder,
)
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import AppliedCommand, CommandReason, JointCommand, JointSample, WrenchKind, WrenchSample

# As a module: a suite that is imported by name would be run here once more as it is.
from tests.contracts import test_fake as fake

STEP_NS = 5_000_000


# --- Broken lives: shown on the force sensor, the clauses are the same for every device.


class WithoutAcknowledge(FakeForceSensor):
    """Like a stranger's class that forgot a method."""

    def __getattribute__(self, name: str) -> object:
        if name == "acknowledge_fault":
            raise AttributeError(name)
        return super().__getattribute__(name)


class BornFaulty(FakeForceSensor):
    def __init__(self, clock: FakeClock) -> None:
        super().__init__(clock)
        self._fault = "left from last time"


class OpensInConstructor(FakeForceSensor):
    def __init__(self, clock: FakeClock) -> None:
        super().__init__(clock)
        self.is_open = True


class OpensTooLate(FakeForceSensor):
    def _on_configure(self) -> None: ...


class ActivatesOnce(FakeForceSensor):
    used = False

    def _on_activate(self) -> None:
        if self.used:
            raise RuntimeError("only once")
        self.used = True


class ActivatesTwice(FakeForceSensor):
    def activate(self) -> None:
        if self._life is not Life.ACTIVE:
            super().activate()


class ConfiguresWhileFaulted(FakeForceSensor):
    def configure(self) -> None:
        if self._life is not Life.FAULTED:
            super().configure()


class ReadsWhenClosed(FakeForceSensor):
    def _require_active(self, request: str) -> None:
        if self._life is not Life.CLOSED:
            super()._require_active(request)


class ReadsWhenDeactivated(FakeForceSensor):
    deactivated = False

    def _on_deactivate(self) -> None:
        self.deactivated = True

    def _require_active(self, request: str) -> None:
        if not self.deactivated:
            super()._require_active(request)


class RefusesToClose(FakeForceSensor):
    refused_in = Life.CONSTRUCTED

    def close(self) -> None:
        if self._life is self.refused_in:
            raise RuntimeError("cannot be closed now")
        super().close()


class RefusesToCloseFaulted(RefusesToClose):
    refused_in = Life.FAULTED


class RefusesToCloseTwice(RefusesToClose):
    refused_in = Life.CLOSED


class StaysOpen(FakeForceSensor):
    def _on_close(self) -> None: ...


class FaultClearsItself(FakeForceSensor):
    def read(self) -> WrenchSample:
        try:
            return super().read()
        finally:
            if self._life is Life.FAULTED:
                self._life = Life.ACTIVE


class ActivateClearsFault(FakeForceSensor):
    def activate(self) -> None:
        if self._life is Life.FAULTED:
            self.acknowledge_fault()
        super().activate()


class AcknowledgeActivates(FakeForceSensor):
    def acknowledge_fault(self) -> None:
        super().acknowledge_fault()
        self.activate()


class HidesDisconnection(FakeForceSensor):
    def _require_connection(self) -> None: ...


LIVES: list[tuple[Any, dict[str, Any], set[str]]] = [
    (WithoutAcknowledge, {"provoke_fault": None}, {"test_matches_the_port", "test_illegal_requests_raise"}),
    (BornFaulty, {}, {"test_starts_constructed"}),
    (OpensInConstructor, {}, {"test_constructor_opens_nothing"}),
    (OpensTooLate, {}, {"test_constructor_opens_nothing"}),
    (ActivatesOnce, {"provoke_fault": None}, {"test_whole_life"}),
    (ActivatesTwice, {}, {"test_illegal_requests_raise"}),
    (ConfiguresWhileFaulted, {}, {"test_illegal_requests_raise_while_faulted"}),
    (ReadsWhenClosed, {}, {"test_use_outside_active_raises"}),
    (ReadsWhenDeactivated, {}, {"test_deactivated_device_refuses"}),
    (RefusesToClose, {}, {"test_close_works_from_every_state"}),
    (RefusesToCloseFaulted, {}, {"test_close_works_while_faulted"}),
    (RefusesToCloseTwice, {}, {"test_close_twice"}),
    (StaysOpen, {}, {"test_close_releases"}),
    (FaultClearsItself, {}, {"test_fault_latches"}),
    (
        ActivateClearsFault,
        {},
        {"test_activate_does_not_clear_a_fault", "test_illegal_requests_raise_while_faulted"},
    ),
    (AcknowledgeActivates, {}, {"test_acknowledging_does_not_activate"}),
    (HidesDisconnection, {}, {"test_lost_device_raises"}),
]


# --- Broken samples: shown on the force sensor too.


class Altered(FakeForceSensor):
    """Gives a sample that differs from the true one by ``alter``."""

    def __init__(self, clock: FakeClock, alter: Callable[[WrenchSample], WrenchSample]) -> None:
        super().__init__(clock)
        self.alter = alter

    def read(self) -> WrenchSample:
        return self.alter(super().read())


def altered(**changes: Callable[[WrenchSample], Any]) -> Callable[[FakeClock], Altered]:
    def alter(sample: WrenchSample) -> WrenchSample:
        return replace(sample, **{name: change(sample) for name, change in changes.items()})

    return lambda clock: Altered(clock, alter)


class CountsReadings(FakeForceSensor):
    """Passes the same sample off as a new one each time it is read."""

    readings = 0

    def read(self) -> WrenchSample:
        self.readings += 1
        return replace(super().read(), sequence=self.readings)


def never_stale(clock: FakeClock) -> FakeForceSensor:
    return FakeForceSensor(clock, max_age_ns=10**18)


class TaresOnConfigure(FakeForceSensor):
    zero_N = (0.0, 0.0, 0.0)

    def _on_configure(self) -> None:
        super()._on_configure()
        self.zero_N = self.load_N

    def read(self) -> WrenchSample:
        sample = super().read()
        return replace(sample, force_N=tuple(f - zero for f, zero in zip(sample.force_N, self.zero_N, strict=True)))


class TaresOnActivate(TaresOnConfigure):
    def _on_activate(self) -> None:
        self.zero_N = self.load_N


class TaresOnFirstReading(TaresOnConfigure):
    tared = False

    def read(self) -> WrenchSample:
        if not self.tared:
            self.zero_N, self.tared = self.load_N, True
        return super().read()


TARE = {"test_no_hidden_tare"}
SAMPLES: list[tuple[Any, dict[str, Any], set[str]]] = [
    (altered(receive_time_ns=lambda s: float(s.receive_time_ns)), {}, {"test_stamps_are_integers"}),
    (altered(sequence=lambda s: s.sequence + 0.5), {}, {"test_stamps_are_integers"}),
    (altered(receive_time_ns=lambda s: s.source_time_ns - 1), {}, {"test_times_are_in_order"}),
    (altered(receive_time_ns=lambda s: s.receive_time_ns + 1), {}, {"test_times_are_in_order"}),
    (altered(source_time_ns=lambda s: s.source_time_ns - 9 * TICK_NS), {}, {"test_valid_sample_is_young"}),
    (altered(sequence=lambda s: s.sequence % 256), {}, {"test_sequence_and_time_never_go_back"}),
    (altered(sequence=lambda s: s.sequence // 2), {}, {"test_world_going_on_brings_news"}),
    (CountsReadings, {}, {"test_reading_twice_gives_the_same_sample"}),
    (never_stale, {}, {"test_silence_is_not_passed_off_as_news"}),
    (altered(force_N=lambda s: list(s.force_N)), {}, {"test_wrench_is_six_floats"}),
    (altered(torque_Nm=lambda _: (0, 0, 0)), {}, {"test_wrench_is_six_floats"}),
    (altered(kind=lambda _: WrenchKind.TARED), {}, {"test_kind_is_the_declared_one"}),
    (altered(frame=lambda _: " "), {}, {"test_frame_is_named"}),
    (
        altered(force_N=lambda s: tuple(-f for f in s.force_N)),
        {},
        {"test_pressing_on_the_tip_gives_negative_fz"},
    ),
    (
        altered(force_N=lambda s: tuple(f / 9.80665 for f in s.force_N)),
        {},
        {"test_load_is_reported_in_newtons_on_its_axis"},
    ),
    (
        altered(force_N=lambda s: (s.force_N[1], s.force_N[0], s.force_N[2])),
        {},
        {"test_load_is_reported_in_newtons_on_its_axis"},
    ),
    (TaresOnConfigure, {}, TARE),
    (TaresOnActivate, {}, TARE),
    (TaresOnFirstReading, {}, TARE),
]


# --- Broken encoders.


class GivesList(FakeJointEncoder):
    def read(self) -> JointSample:
        sample = super().read()
        return replace(sample, position_rad=list(sample.position_rad))  # type: ignore[arg-type]


class LosesJoint(FakeJointEncoder):
    def read(self) -> JointSample:
        sample = super().read()
        return replace(sample, position_rad=sample.position_rad[:2]) if sample.sequence % 7 == 3 else sample


class GivesDegrees(FakeJointEncoder):
    def read(self) -> JointSample:
        sample = super().read()
        return replace(sample, position_rad=tuple(q * 57.3 for q in sample.position_rad))


class OffByOne(FakeJointEncoder):
    def read(self) -> JointSample:
        sample = super().read()
        return replace(sample, position_rad=tuple(q + 0.01 for q in sample.position_rad))


class ReportsTarget(FakeJointEncoder):
    arm: FakeArm

    def read(self) -> JointSample:
        return replace(super().read(), position_rad=self.arm._target_rad)


class MeasuresTarget(FakeJointEncoder):
    """Keeps a sample once taken, but takes it from the command of its own tick."""

    arm: FakeArm

    def read(self) -> JointSample:
        self._position_rad = lambda: self.arm._target_rad
        return super().read()


CAUSAL = {"test_observation_does_not_depend_on_the_command_of_its_tick"}
ENCODERS: list[tuple[Any, dict[str, Any], set[str]]] = [
    (GivesList, {}, {"test_angles_are_floats"}),
    (LosesJoint, {}, {"test_number_of_joints_is_constant"}),
    (GivesDegrees, {"expected_rad": None}, {"test_angles_are_plausible_radians"}),
    (OffByOne, {}, {"test_angles_are_where_the_joints_stand"}),
    (ReportsTarget, {}, CAUSAL),
    (MeasuresTarget, {}, CAUSAL),
]


# --- Broken arms.


class ChangesSecretly(FakeArm):
    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        return replace(applied, position_rad=tuple(q - 1e-9 for q in applied.position_rad))


class Sags(FakeArm):
    def position_rad(self) -> tuple[float, ...]:
        here = super().position_rad()
        return here if here == fake.HOME_RAD else tuple(q - 1e-4 for q in here)


class JumpsWhenActivated(FakeArm):
    def _on_activate(self) -> None:
        self._here_rad = self._target_rad = tuple(q + 0.005 for q in fake.HOME_RAD)
        self._stopped = False


class ClampsSilently(FakeArm):
    hushed = CommandReason.POSITION_LIMIT

    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        return replace(applied, reason=CommandReason.AS_ASKED) if applied.reason is self.hushed else applied


class SlowsSilently(ClampsSilently):
    hushed = CommandReason.VELOCITY_LIMIT


class KnowsNoLimit(FakeArm):
    def _on_configure(self) -> None:
        super()._on_configure()
        self._upper_rad = (9.0, 9.0, 9.0)


class KnowsNoSpeed(FakeArm):
    def _on_configure(self) -> None:
        super()._on_configure()
        self._max_step_rad = 9.0


class TakesAnyNumber(FakeArm):
    def send(self, command: JointCommand) -> AppliedCommand:
        return super().send(JointCommand((*command.position_rad, 0.0)[:3]))


class Queues(FakeArm):
    """Works off its commands one tick after the other."""

    def _on_configure(self) -> None:
        super()._on_configure()
        self.queue: deque[tuple[float, ...]] = deque()
        self.last_ns = self.clock.now_ns()

    def position_rad(self) -> tuple[float, ...]:
        if self.clock.now_ns() > self.last_ns and self.queue:
            self._here_rad, self.last_ns = self.queue.popleft(), self.clock.now_ns()
        return self._here_rad

    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        self.queue.append(applied.position_rad)
        self.last_ns = self.clock.now_ns()
        return applied

    def _halt(self) -> None:
        self.queue = deque()


class FirstCommandWins(FakeArm):
    def send(self, command: JointCommand) -> AppliedCommand:
        target_rad, since_ns = self._target_rad, self._target_since_ns
        applied = super().send(command)
        if since_ns == self.clock.now_ns():
            self._target_rad = target_rad
        return applied


class StopsOnlyAlive(FakeArm):
    refused_in = Life.CLOSED

    def stop(self) -> None:
        if self._life is self.refused_in:
            raise RuntimeError("not now")
        super().stop()


class StopsOnlyOnce(FakeArm):
    def stop(self) -> None:
        if self._stopped:
            raise RuntimeError("already stopped")
        super().stop()


class StopsOnlyHealthy(StopsOnlyAlive):
    refused_in = Life.FAULTED


class HidesStop(FakeArm):
    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        return AppliedCommand(command.position_rad) if self._stopped else applied


class CreepsOn(FakeArm):
    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        if self._stopped:
            self._target_rad = tuple(q + 1e-4 for q in self.position_rad())
        return applied


class StopsForEver(FakeArm):
    def _on_activate(self) -> None: ...


ARMS: list[tuple[Any, dict[str, Any], set[str]]] = [
    (ChangesSecretly, {}, {"test_small_legal_move_is_applied_as_asked"}),
    (Sags, {}, {"test_arm_goes_where_it_was_told", "test_newest_command_wins"}),
    (JumpsWhenActivated, {}, {"test_activation_does_not_move_the_arm"}),
    (ClampsSilently, {}, {"test_position_limit_is_applied_and_told"}),
    (KnowsNoLimit, {}, {"test_position_limit_is_applied_and_told"}),
    (
        SlowsSilently,
        {},
        {"test_velocity_limit_is_applied_and_told", "test_position_limit_is_applied_and_told"},
    ),
    (KnowsNoSpeed, {}, {"test_velocity_limit_is_applied_and_told"}),
    (TakesAnyNumber, {}, {"test_wrong_number_of_joints_is_refused"}),
    (Queues, {}, {"test_newest_command_wins"}),
    (FirstCommandWins, {}, {"test_newest_command_wins"}),
    (StopsOnlyAlive, {}, {"test_stop_works_in_every_state"}),
    (StopsOnlyOnce, {}, {"test_stop_works_in_every_state", "test_stop_works_while_faulted"}),
    (StopsOnlyHealthy, {}, {"test_stop_works_while_faulted"}),
    (HidesStop, {}, {"test_after_stop_send_applies_nothing"}),
    (CreepsOn, {}, {"test_after_stop_the_arm_holds_still"}),
    (StopsForEver, {}, {"test_activating_again_ends_the_stop"}),
]


# --- Broken clocks.


class TellsSeconds(FakeClock):
    def now_ns(self) -> int:
        return float(super().now_ns())  # type: ignore[return-value]


class SlipsBack(FakeClock):
    asked = 0

    def now_ns(self) -> int:
        self.asked += 1
        return super().now_ns() - (self.asked == 500)


class WakesEarly(FakeClock):
    def sleep_until(self, deadline_ns: int) -> None:
        super().sleep_until(deadline_ns - 1)


class WakesLate(FakeClock):
    def sleep_until(self, deadline_ns: int) -> None:
        if deadline_ns > self.now_ns():
            super().sleep_until(deadline_ns + 1)


class TurnsBack(FakeClock):
    def sleep_until(self, deadline_ns: int) -> None:
        self._now_ns = deadline_ns


class AlwaysSleeps(FakeClock):
    def sleep_until(self, deadline_ns: int) -> None:
        self._now_ns = max(deadline_ns, self._now_ns + STEP_NS)


class Drifts(FakeClock):
    """Sleeps for a duration, each time a little too long."""

    late_ns = 0

    def sleep_until(self, deadline_ns: int) -> None:
        self.late_ns += 1
        super().sleep_until(deadline_ns + self.late_ns if deadline_ns > self.now_ns() else deadline_ns)


NO_DRIFT = "test_absolute_deadlines_do_not_drift"
CLOCKS: list[tuple[Any, dict[str, Any], set[str]]] = [
    (TellsSeconds, {}, {"test_time_is_integer_nanoseconds"}),
    (SlipsBack, {}, {"test_time_never_goes_back"}),
    (WakesEarly, {}, {"test_sleep_reaches_the_deadline", NO_DRIFT}),
    (WakesLate, {}, {"test_sleep_is_not_late", NO_DRIFT}),
    (TurnsBack, {}, {"test_past_deadline_returns_at_once"}),
    (AlwaysSleeps, {}, {"test_past_deadline_returns_at_once"}),
    (Drifts, {"tolerance_ns": 5}, {NO_DRIFT}),
]

FORCE, ENCODER, ARM, CLOCK = SUITES = (
    fake.TestFakeForceSensor,
    fake.TestFakeJointEncoder,
    fake.TestFakeArm,
    fake.TestFakeClock,
)
CASES = [
    *((FORCE, *case) for case in LIVES + SAMPLES),
    *((ENCODER, *case) for case in ENCODERS),
    *((ARM, *case) for case in ARMS),
    *((CLOCK, *case) for case in CLOCKS),
]


def failed(suite: object) -> dict[str, str]:
    return {r.clause.name: r.message for r in run_clauses(suite) if r.outcome is ClauseOutcome.FAILED}


@pytest.mark.parametrize(("suite", "broken", "knobs", "intended"), CASES)
def test_a_broken_adapter_fails_exactly_the_intended_clauses(
    suite: Any, broken: Any, knobs: dict[str, Any], intended: set[str]
) -> None:
    # That a sound one fails none is what test_fake.py shows.
    assert failed(suite.trying(broken, **knobs)).keys() == intended


def test_every_clause_has_bitten() -> None:
    everything = {clause.name for suite in SUITES for clause in clauses(suite)}
    bitten = set().union(*(case[-1] for case in CASES))
    assert everything - bitten == {"test_command_that_is_not_finite_cannot_be_made"}  # below


def test_a_command_of_nan_would_be_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(JointCommand, "__post_init__", lambda self: None)
    assert failed(ARM()).keys() == {"test_command_that_is_not_finite_cannot_be_made"}


def test_a_violation_says_what_was_seen_and_what_is_wanted() -> None:
    suite = FORCE.trying(altered(force_N=lambda s: tuple(-f for f in s.force_N)))
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
    suite = FORCE.trying(CountsReadings, runs_by_itself=True)
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
    assert names[-1] == "test_activating_again_ends_the_stop"


def test_a_class_in_place_of_a_suite_is_refused_and_not_found_to_be_sound() -> None:
    with pytest.raises(ConfigurationError, match="an instance of a contract suite"):
        run_clauses(ClockContract)
