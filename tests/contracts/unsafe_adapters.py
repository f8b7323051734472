"""Adapters that would hurt somebody, each a good fake with one thing overridden, and the clause that has to say so.

What `broken_arms` and `broken_sensors` have already is not here again.
"""

from collections.abc import Callable
from dataclasses import replace
from math import nan
from threading import Event, Thread
from time import sleep
from typing import Any

from palpate.core.ports import CommandReason, JointCommand, Life, Validity
from palpate.core.ports.contracts.fakes import TICK_NS, FakeArm, FakeForceSensor, FakeJointEncoder
from tests.contracts import test_fake as fake
from tests.contracts.broken_sensors import CountsReadings, altered

HOME = fake.HOME_RAD


def unsafe(base: Any, name: str, /, **overridden: Any) -> Any:
    """A kind of device in which some methods are others."""
    return type(name, (base,), overridden)


def first(act: Callable[[Any], object], method: str, base: Any = FakeArm) -> Callable[..., Any]:
    """The method, but something happens first."""

    def done(self: Any, *arguments: Any) -> Any:
        act(self)
        return getattr(base, method)(self, *arguments)

    return done


def opened(self: Any) -> None:
    self.is_open = True


def slow(self: Any) -> None:
    self.clock.sleep_until(self.clock.now_ns() + 2 * TICK_NS)


def sleepy(self: Any) -> None:
    self.clock.sleep_until(self.clock.now_ns() + 10**10)


def ask(self: Any) -> None:
    self._require_connection()


# The life of a device


class OpensTwice(FakeForceSensor):
    handles = 0

    def configure(self) -> None:
        self.handles += 1
        super().configure()

    def _on_close(self) -> None:
        self.handles -= 1
        self.is_open = self.handles > 0


class LeavesThread(FakeForceSensor):
    def _on_configure(self) -> None:
        super()._on_configure()
        Thread(target=Event().wait, args=(5.0,), daemon=True).start()


def configure_blindly(self: Any) -> None:
    self.is_open = True


# Calls that block


class AwaitsNews(FakeForceSensor):
    """Reading a second time waits for the next sample."""

    def read(self) -> Any:
        if self._sample is not None and self._sample.source_time_ns == self.clock.now_ns() and not self.silent:
            sleep(0.01)
        return super().read()


class AwaitsTheSilent(FakeForceSensor):
    def read(self) -> Any:
        if self.silent:
            self.clock.sleep_until(self.clock.now_ns() + 10**9)
        return super().read()


# Samples


class NowAndThen(FakeForceSensor):
    """One sample in seven is not finite and passed off as good."""

    def read(self) -> Any:
        sample = super().read()
        if sample.sequence % 7 == 5:
            sample = replace(sample, force_N=(nan, 0.0, 0.0), validity=Validity.INVALID)
            object.__setattr__(sample, "validity", Validity.VALID)
        return sample


class EverySecondIsOld(FakeForceSensor):
    """New number and time, but the forces of the sample before."""

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        return replace(sample, force_N=self._sample.force_N) if sequence % 2 and self._sample else sample


class KeepsItOverAPause(FakeForceSensor):
    """The first reading after a pause is the last one before it, as good as new."""

    awake = True

    def _on_deactivate(self) -> None:
        self.awake = False

    def read(self) -> Any:
        self._require_active("read()")
        if not self.awake and self._sample is not None:
            self.awake = True
            return self._sample
        return super().read()


def frozen(self: Any, now_ns: int, sequence: int) -> Any:
    sample = FakeJointEncoder._measured(self, now_ns, sequence)
    return replace(sample, position_rad=self._sample.position_rad) if self._sample else sample


FIRST_FLIPPED = altered(FakeJointEncoder, position_rad=lambda s: (-s.position_rad[0], *s.position_rad[1:]))
ABOUT_HOME = altered(FakeJointEncoder, position_rad=lambda s: (*s.position_rad[:2], 2 * HOME[2] - s.position_rad[2]))
SWAPPED = altered(FakeJointEncoder, position_rad=lambda s: (s.position_rad[1], s.position_rad[0], s.position_rad[2]))
MIRRORED = altered(FakeForceSensor, force_N=lambda s: (-s.force_N[0], *s.force_N[1:]))
SMALL = altered(FakeJointEncoder, position_rad=lambda s: tuple(q / 57.2958 for q in s.position_rad))

# Arms that do not come to rest


def only_said(self: Any) -> None:
    self._stopped = True


def left_moving(self: Any) -> None: ...


class StopsLate(FakeArm):
    """Returns from stop() while it still moves, and holds where it then is."""

    def stop(self) -> None:
        self._stopped = True


class StopsAtHome(FakeArm):
    def stop(self) -> None:
        super().stop()
        self._target_rad = HOME


class HoldsFirstStop(FakeArm):
    held: Any = None

    def stop(self) -> None:
        super().stop()
        self.held = self._target_rad = self.held or self._target_rad


class SaysItIsAtHome(FakeArm):
    def send(self, command: JointCommand) -> Any:
        applied = super().send(command)
        return replace(applied, position_rad=HOME) if applied.reason is CommandReason.STOPPED else applied


class StopWearsOff(FakeArm):
    stopped_ns = 0

    def stop(self) -> None:
        super().stop()
        self.stopped_ns = self.clock.now_ns()

    def send(self, command: JointCommand) -> Any:
        self._stopped = self._stopped and self.clock.now_ns() < self.stopped_ns + 50 * TICK_NS
        return super().send(command)


class MovesOnAfterStop(FakeArm):
    """A second after a stop the motion goes on, without a command."""

    def stop(self) -> None:
        self.asked_rad, self.stopped_ns = self._target_rad, self.clock.now_ns()
        super().stop()

    def position_rad(self) -> Any:
        if self._stopped and self.clock.now_ns() > self.stopped_ns + 140 * TICK_NS:
            self._target_rad = self.asked_rad
        return super().position_rad()


class Resumes(FakeArm):
    """Activated again, it goes on to where it was sent before."""

    after = "stop"

    def _halt(self) -> None:
        if self._target_rad != self.position_rad():
            self.asked_rad = self._target_rad
        super()._halt()

    def stop(self) -> None:
        super().stop()
        self.after_what = "stop"

    def fail(self, cause: str = "") -> None:
        super().fail("overload")
        self.after_what = "fault"

    def _on_activate(self) -> None:
        self._stopped = False
        if getattr(self, "after_what", "") == self.after:
            self._target_rad = self.asked_rad


class ActivatesAtHome(FakeArm):
    def _on_activate(self) -> None:
        super()._on_activate()
        self._target_rad = HOME


class Coasts(FakeArm):
    """With a fault, it soon drifts on."""

    def position_rad(self) -> Any:
        ticks = (self.clock.now_ns() - self._target_since_ns) / TICK_NS
        drift = 1e-5 * max(0.0, ticks - 5.0) if self._fault else 0.0
        return tuple(q + drift for q in super().position_rad())


class StopForgetsFault(FakeArm):
    def stop(self) -> None:
        super().stop()
        if self._life is Life.FAULTED:
            self._life, self._fault = Life.CONFIGURED, None


# Commands


class DropsEverySecond(FakeArm):
    sent = 0

    def send(self, command: JointCommand) -> Any:
        before, since_ns = self._target_rad, self._target_since_ns
        applied = super().send(command)
        self.sent += 1
        if not self.sent % 2:
            self._target_rad, self._target_since_ns = before, since_ns
        return applied


class SwapsMoves(FakeArm):
    """Joint 1 makes the moves of joint 2, and the other way round."""

    def position_rad(self) -> Any:
        q = super().position_rad()
        return (HOME[0] + q[1] - HOME[1], HOME[1] + q[0] - HOME[0], q[2])


class MovesUnasked(FakeArm):
    """Passes on what it refuses."""

    refused_in: Any = None

    def send(self, command: JointCommand) -> Any:
        if self._life is (self.refused_in or self._life):
            self._target_rad, self._target_since_ns = command.position_rad[:3], self.clock.now_ns()
        return super().send(command)


class OnlyBounds(FakeArm):
    """Some of the limits are not there."""

    absent: tuple[tuple[str, int], ...] = ()

    def _on_configure(self) -> None:
        super()._on_configure()
        for name, joint in self.absent:
            limits = list(getattr(self, name))
            limits[joint] *= 9.0
            setattr(self, name, tuple(limits))


class SaysLimitAndGoesOn(FakeArm):
    def send(self, command: JointCommand) -> Any:
        applied = super().send(command)
        if applied.reason is CommandReason.POSITION_LIMIT:
            self._target_rad = command.position_rad
        return applied


class SlowForwardsOnly(FakeArm):
    def send(self, command: JointCommand) -> Any:
        here = self.position_rad()
        backwards = (
            len(command.position_rad) == len(here)
            and min(q - p for q, p in zip(command.position_rad, here, strict=True)) < -0.02
        )
        self._max_step_rad = 9.0 if backwards else 0.02
        return super().send(command)


class AddsUpWithinATick(FakeArm):
    """The velocity limit counts from the last command, not from the tick."""

    def send(self, command: JointCommand) -> Any:
        here, self._here_rad = self._here_rad, self._target_rad
        try:
            return super().send(command)
        finally:
            self._here_rad = here


class LimitsTheFirstTickOnly(FakeArm):
    """Further ticks of a motion that was too fast are as fast as they were asked."""

    limited_ns = -1

    def send(self, command: JointCommand) -> Any:
        now_ns = self.clock.now_ns()
        self._max_step_rad = 0.02 if self.limited_ns in (-1, now_ns) else 9.0
        applied = super().send(command)
        self.limited_ns = now_ns if applied.reason is CommandReason.VELOCITY_LIMIT else -1
        return applied


class LimitsOneJoint(FakeArm):
    def send(self, command: JointCommand) -> Any:
        ways = zip(command.position_rad, self.position_rad(), strict=False)
        self._max_step_rad = 9.0 if sum(abs(q - p) > 0.02 for q, p in ways) > 1 else 0.02
        return super().send(command)


class StopsOnce(FakeArm):
    stops = 0

    def stop(self) -> None:
        self.stops += 1
        self._stopped = True
        if self.stops == 1:
            self._halt()


class BrakeLetsGoLate(FakeArm):
    """Deactivated, it holds for a while before it sinks."""

    paused_ns = 0

    def _on_deactivate(self) -> None:
        super()._on_deactivate()
        self.paused_ns = self.clock.now_ns()

    def position_rad(self) -> Any:
        q = super().position_rad()
        sinks = self._life is Life.CONFIGURED and 0 < self.paused_ns < self.clock.now_ns() - 100 * TICK_NS
        return (q[0] + 0.01, *q[1:]) if sinks else q


def to_home(self: Any) -> None:
    self._target_rad, self._target_since_ns = HOME, self.clock.now_ns()


def set_paused(self: Any) -> None:
    self.paused = True


def rezeroed(self: Any, now_ns: int, sequence: int) -> Any:
    """After a pause the sensor begins at zero again."""
    sample = FakeForceSensor._measured(self, now_ns, sequence)
    return replace(sample, force_N=(0.0, 0.0, 0.0)) if getattr(self, "paused", False) else sample


SWAPS_PULLS = altered(FakeForceSensor, force_N=lambda s: s.force_N if min(s.force_N[:2]) >= 0.0 else s.force_N[::-1])
ABSOLUTE = altered(FakeForceSensor, torque_Nm=lambda s: tuple(map(abs, s.torque_Nm)))

FORCE, ENCODER, ARM = fake.TestFakeForceSensor, fake.TestFakeJointEncoder, fake.TestFakeArm
SENSOR, PLAIN = FakeForceSensor, FakeArm
BY_ITSELF: dict[str, Any] = {"runs_by_itself": True}
UNKNOWN: dict[str, Any] = {"expected_rad": None}
BLOCK, RELEASE, AJAR = "calls_do_not_block", "close_releases", "failed_configure_leaves_nothing_open"
TARE, LOAD = "no_hidden_tare", "load_is_reported_in_newtons_on_its_axis"
TORQUE, FOLLOW = "torque_is_reported_in_newton_metres_on_its_axis", "encoders_follow_each_joint"
STILL, DROPPED, HELD = "after_stop_the_arm_holds_still", "command_under_way_is_dropped", "stop_holds_the_pose_of_now"
REST, REFUSED, COUNTS = "motion_ends_and_does_not_resume", "refused_command_moves_nothing", "each_command_counts"
BOUNDS, SPEED = "position_limit_is_applied_and_told", "velocity_limit_is_applied_and_told"

LISTED: list[tuple[Any, Any, dict[str, Any], str]] = [
    (FORCE, unsafe(SENSOR, "Bye", _on_close=first(ask, "_on_close", SENSOR)), {}, "close_works_once_the_cable_is_cut"),
    (FORCE, unsafe(SENSOR, "OpensThenChecks", _on_configure=first(opened, "_on_configure", SENSOR)), {}, AJAR),
    (FORCE, unsafe(SENSOR, "ConfiguresNothing", _on_configure=configure_blindly), {}, AJAR),
    (FORCE, OpensTwice, {}, RELEASE),
    (FORCE, unsafe(SENSOR, "OpensOnceMore", configure=first(opened, "configure", SENSOR)), {}, RELEASE),
    (FORCE, LeavesThread, {}, "close_leaves_no_thread"),
    (FORCE, unsafe(SENSOR, "SlowReading", read=first(slow, "read", SENSOR)), {}, BLOCK),
    (FORCE, unsafe(SENSOR, "SlowByTheWall", read=first(lambda _: sleep(0.01), "read", SENSOR)), {}, BLOCK),
    (FORCE, AwaitsNews, {}, BLOCK),
    (ARM, unsafe(PLAIN, "SlowSending", send=first(slow, "send")), {}, BLOCK),
    (FORCE, AwaitsTheSilent, {}, "silence_is_not_passed_off_as_news"),
    (FORCE, NowAndThen, {}, "wrench_is_six_floats"),
    (FORCE, EverySecondIsOld, {}, "load_is_reported_in_newtons_on_its_axis"),
    (FORCE, KeepsItOverAPause, {}, "sample_after_a_pause_is_new"),
    (FORCE, CountsReadings, BY_ITSELF, "reading_twice_gives_the_same_sample"),
    (FORCE, altered(SENSOR, frame=lambda _: "base"), {}, "frame_is_named"),
    (FORCE, MIRRORED, {}, "pressing_on_the_tip_gives_negative_fz"),
    (FORCE, altered(SENSOR, torque_Nm=lambda s: tuple(1e3 * t for t in s.torque_Nm)), {}, TORQUE),
    (FORCE, altered(SENSOR, torque_Nm=lambda s: (s.torque_Nm[1], s.torque_Nm[0], s.torque_Nm[2])), {}, TORQUE),
    (ENCODER, FIRST_FLIPPED, UNKNOWN, FOLLOW),
    (ENCODER, ABOUT_HOME, {}, FOLLOW),
    (ENCODER, SWAPPED, UNKNOWN, FOLLOW),
    (ENCODER, SMALL, UNKNOWN, FOLLOW),
    (ENCODER, unsafe(FakeJointEncoder, "Frozen", _measured=frozen), {}, FOLLOW),
    (ARM, unsafe(PLAIN, "StopAsksTheArm", stop=first(ask, "stop")), {}, "stop_works_once_the_cable_is_cut"),
    (ARM, unsafe(PLAIN, "StopSendsNothing", stop=only_said), {}, DROPPED),
    (ARM, unsafe(PLAIN, "StopNeverReturns", stop=first(sleepy, "stop")), {}, "stop_works_in_every_state"),
    (ARM, unsafe(PLAIN, "DeactivateLeavesItMoving", _on_deactivate=left_moving), {}, DROPPED),
    (ARM, unsafe(PLAIN, "CloseLeavesItMoving", _on_close=lambda self: setattr(self, "is_open", False)), {}, DROPPED),
    (ARM, StopsAtHome, {}, HELD),
    (ARM, HoldsFirstStop, {}, HELD),
    (ARM, SaysItIsAtHome, {}, HELD),
    (ARM, StopWearsOff, {}, STILL),
    (ARM, MovesOnAfterStop, {}, STILL),
    (ARM, Resumes, {}, REST),
    (ARM, unsafe(Resumes, "ResumesAfterFault", after="fault"), {}, REST),
    (ARM, ActivatesAtHome, {}, REST),
    (ARM, Coasts, {}, REST),
    (ARM, StopForgetsFault, {}, "stop_works_while_faulted"),
    (ARM, DropsEverySecond, {}, COUNTS),
    (ARM, SwapsMoves, {}, COUNTS),
    (ARM, MovesUnasked, {}, REFUSED),
    (ARM, unsafe(MovesUnasked, "MovesWhileFaulted", refused_in=Life.FAULTED), {}, REFUSED),
    (ARM, unsafe(MovesUnasked, "MovesWhileDeactivated", refused_in=Life.CONFIGURED), {}, REFUSED),
    (ARM, unsafe(OnlyBounds, "NoLowerLimit", absent=(("_lower_rad", 2),)), {}, BOUNDS),
    (ARM, unsafe(OnlyBounds, "NoLimitOfTheFirst", absent=(("_upper_rad", 0), ("_lower_rad", 0))), {}, BOUNDS),
    (ARM, SaysLimitAndGoesOn, {}, BOUNDS),
    (ARM, SlowForwardsOnly, {}, SPEED),
    (ARM, AddsUpWithinATick, {}, SPEED),
    (ARM, LimitsTheFirstTickOnly, {}, SPEED),
    (ARM, LimitsOneJoint, {}, SPEED),
    (ARM, StopsOnce, {}, DROPPED),
    (ARM, unsafe(PLAIN, "DeactivatesTowardsHome", _on_deactivate=to_home), {}, DROPPED),
    (ARM, BrakeLetsGoLate, {}, REST),
    (FORCE, unsafe(SENSOR, "TaresAfterAPause", _measured=rezeroed, _on_deactivate=set_paused), {}, TARE),
    (FORCE, SWAPS_PULLS, {}, LOAD),
    (FORCE, ABSOLUTE, {}, TORQUE),
]
UNSAFE = [(suite, kind, knobs, f"test_{clause}") for suite, kind, knobs, clause in LISTED]
