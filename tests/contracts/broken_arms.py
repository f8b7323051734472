"""Broken encoders, arms and clocks, and the clauses by which the contracts notice them."""

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from palpate.core.ports import AppliedCommand, CommandReason, JointCommand, JointSample, Life
from palpate.core.ports.contracts import FakeClock
from tests.contracts import test_fake as fake
from tests.contracts.broken_sensors import LIVED, altered
from tests.fake_devices import FakeArm, FakeJointEncoder

STEP_NS = 5_000_000


def plus(error: Callable[[float], float]) -> Any:
    """Encoders whose angles are off by something."""
    return altered(FakeJointEncoder, position_rad=lambda s: tuple(q + error(q) for q in s.position_rad))


class LosesJoint(FakeJointEncoder):
    def read(self) -> JointSample:
        sample = super().read()
        return replace(sample, position_rad=sample.position_rad[:2]) if sample.sequence % 7 == 3 else sample


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


UNTURNED: dict[str, Any] = {"turn_by_hand": None}
CAUSAL = {"test_observation_does_not_depend_on_the_command_of_its_tick"}
ENCODERS: list[tuple[Any, dict[str, Any], set[str]]] = [
    (altered(FakeJointEncoder, position_rad=lambda s: list(s.position_rad)), UNTURNED, {"test_every_sample_is_sound"}),
    (LosesJoint, UNTURNED, {"test_every_sample_is_sound", *LIVED}),
    (plus(lambda q: 56.3 * q), {"expected_rad": None, "arm": None, **UNTURNED}, {"test_every_sample_is_sound"}),
    (plus(lambda q: 2e-4), UNTURNED, {"test_angles_are_where_the_joints_stand"}),
    (ReportsTarget, {}, CAUSAL),
    (MeasuresTarget, {}, CAUSAL),
]


class ChangesSecretly(FakeArm):
    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        there = zip(applied.position_rad, fake.HOME_RAD, strict=True)
        return applied._replace(position_rad=tuple(home + (q - home) * (1.0 - 1e-7) for q, home in there))


class Sags(FakeArm):
    def position_rad(self) -> tuple[float, ...]:
        here = super().position_rad()
        return here if here == fake.HOME_RAD else tuple(q - 1e-4 for q in here)


class JumpsWhenActivated(FakeArm):
    fresh = True

    def _on_activate(self) -> None:
        super()._on_activate()
        if self.fresh:
            self.fresh, self._target_rad = False, tuple(q + 0.005 for q in fake.HOME_RAD)


class ClampsSilently(FakeArm):
    hushed = CommandReason.POSITION_LIMIT

    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        return applied._replace(reason=CommandReason.AS_ASKED) if applied.reason is self.hushed else applied


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
        if len(command.position_rad) != 3:
            return AppliedCommand(self.position_rad())
        return super().send(command)


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
        return AppliedCommand(applied.position_rad) if self._stopped else applied


class CreepsOn(FakeArm):
    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        if self._stopped:
            self._target_rad = tuple(q + 1e-4 for q in self.position_rad())
        return applied


class StopsForEver(FakeArm):
    def _on_activate(self) -> None: ...


SPEED = "test_velocity_limit_is_applied_and_told"
STOP = {"test_stop_works_in_every_state", "test_fault_latches", "test_stop_works_once_the_cable_is_cut"}
ARMS: list[tuple[Any, dict[str, Any], set[str]]] = [
    (ChangesSecretly, {}, {"test_each_command_counts", "test_lost_device_raises", *LIVED}),
    (
        Sags,
        UNTURNED,
        {
            *LIVED,
            SPEED,
            "test_activation_does_not_move_the_arm",
            "test_lost_device_raises",
            "test_each_command_counts",
            "test_newest_command_wins",
            "test_motion_ends_and_does_not_resume",
            "test_stop_holds_the_pose_of_now",
            "test_position_limit_is_applied_and_told",
        },
    ),
    (JumpsWhenActivated, {}, {"test_activation_does_not_move_the_arm", *LIVED}),
    (ClampsSilently, {}, {"test_position_limit_is_applied_and_told"}),
    (KnowsNoLimit, {}, {"test_position_limit_is_applied_and_told"}),
    (
        SlowsSilently,
        UNTURNED,
        {"test_velocity_limit_is_applied_and_told"},
    ),
    (KnowsNoSpeed, UNTURNED, {"test_velocity_limit_is_applied_and_told"}),
    (TakesAnyNumber, {}, {"test_wrong_number_of_joints_is_refused"}),
    (Queues, {}, {"test_newest_command_wins", "test_stop_in_the_middle_of_send_is_not_overtaken", SPEED}),
    (FirstCommandWins, {}, {"test_newest_command_wins"}),
    (StopsOnlyAlive, {}, {"test_stop_works_in_every_state"}),
    (StopsOnlyOnce, {}, {*STOP, *LIVED, "test_after_stop_send_applies_nothing"}),
    (StopsOnlyHealthy, {}, {"test_fault_latches", "test_command_under_way_is_dropped"}),
    (HidesStop, {}, {"test_after_stop_send_applies_nothing", "test_stop_works_from_another_thread", *LIVED}),
    (CreepsOn, {}, {"test_after_stop_the_arm_holds_still", "test_stop_holds_the_pose_of_now", *LIVED}),
    (StopsForEver, {}, LIVED),
]


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
    (WakesEarly, {}, {NO_DRIFT}),
    (WakesLate, {}, {NO_DRIFT}),
    (TurnsBack, {}, {"test_past_deadline_returns_at_once"}),
    (AlwaysSleeps, {}, {"test_past_deadline_returns_at_once", NO_DRIFT}),
    (Drifts, {"tolerance_ns": 5}, {NO_DRIFT}),
]
