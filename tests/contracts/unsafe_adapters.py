"""Adapters that would hurt somebody, each a good fake with one thing overridden, and the clause that has to say so.

What `broken_arms` and `broken_sensors` have already is not here again.
"""

from collections.abc import Callable
from dataclasses import replace
from math import nan
from threading import Event, Thread
from time import sleep
from typing import Any

from palpate.core.ports import Life, Validity
from palpate.core.ports.contracts import TICK_NS
from tests.contracts import test_fake as fake
from tests.contracts import unsafe_careless as careless
from tests.contracts import unsafe_lives as lives
from tests.contracts import unsafe_long_runs as runs
from tests.contracts.broken_sensors import CountsReadings, altered
from tests.contracts.unsafe_arms import (
    ActivatesAtHome,
    AddsUpWithinATick,
    BrakeLetsGoLate,
    ClosesTowardsHome,
    Coasts,
    CreepsPastItsLimit,
    DropsEverySecond,
    HangsNowAndThen,
    HoldsFirstStop,
    JumpsToItsLimit,
    KeepsOneLimitAtATime,
    LimitsOneJoint,
    LimitsTheFirstTickOnly,
    MovesOnAfterStop,
    MovesUnasked,
    OnlyBounds,
    RefusalEndsStop,
    RemembersWhatItRefused,
    RemembersWhatItSwallowed,
    Resumes,
    SavesUpHaste,
    SaysItIsAtHome,
    SaysLimitAndGoesOn,
    SlowForwardsOnly,
    StopForgetsFault,
    StopsAtHome,
    StopsOnce,
    StopToggles,
    StopWearsOff,
    SwallowsSmallSteps,
    SwapsMoves,
    left_moving,
    only_said,
    to_home,
)
from tests.contracts.unsafe_sensors import (
    ClipsTorque,
    ClockRunsSlow,
    CountsFromZeroAgain,
    OneJointATick,
    OverloadShiftsItsZero,
    SleepsWithTheArm,
    SlipsNowAndThen,
    Sticks,
    WakesWhereItFellAsleep,
    WrapsAtOneTurn,
)
from tests.contracts.unsafe_stops import (
    CannotLeaveItsLimit,
    FaultRunsOutItsMotion,
    FaultWearsOff,
    GoesBackToWhereItWas,
    HearsItsThreadOnly,
    LimitsFromWhereItWas,
    Parks,
    SendOutlastsStop,
    StopReopens,
    StopsForItsThreadOnly,
    StopWaitsForTheLoop,
    TakesTheShortWayRound,
    YieldsToPersistence,
)
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder

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


class SlowByTheWall(FakeForceSensor):
    """For a while, so that the other clauses need not wait as long."""

    readings = 0

    def read(self) -> Any:
        self.readings += 1
        if self.readings <= 10:
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


class KeepsItOverAFault(KeepsItOverAPause):
    def _on_deactivate(self) -> None: ...

    def fail(self, cause: str = "") -> None:
        super().fail("overload")
        self.awake = False


class ZeroesItself(FakeForceSensor):
    """A load that stays for long is taken for the tool's weight."""

    since_ns, was_N = 0, (0.0, 0.0, 0.0)

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        if sample.force_N != self.was_N:
            self.was_N, self.since_ns = sample.force_N, now_ns
        return replace(sample, force_N=(0.0,) * 3) if now_ns - self.since_ns > 100 * TICK_NS else sample


class ZeroNowAndThen(FakeForceSensor):
    """One sample in 64 is zero, and as good as the others."""

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        return replace(sample, force_N=(0.0,) * 3) if sequence % 64 == 63 else sample


class NewAgainInTheEnd(FakeJointEncoder):
    """A silence is marked for a while only."""

    marked = 0

    def read(self) -> Any:
        sample = super().read()
        self.marked += sample.validity is Validity.STALE
        return sample if self.marked < 12 else replace(sample, validity=Validity.VALID)


def frozen(self: Any, now_ns: int, sequence: int) -> Any:
    sample = FakeJointEncoder._measured(self, now_ns, sequence)
    return replace(sample, position_rad=self._sample.position_rad) if self._sample else sample


FIRST_FLIPPED = altered(FakeJointEncoder, position_rad=lambda s: (-s.position_rad[0], *s.position_rad[1:]))
ABOUT_HOME = altered(FakeJointEncoder, position_rad=lambda s: (*s.position_rad[:2], 2 * HOME[2] - s.position_rad[2]))
SWAPPED = altered(FakeJointEncoder, position_rad=lambda s: (s.position_rad[1], s.position_rad[0], s.position_rad[2]))
MIRRORED = altered(FakeForceSensor, force_N=lambda s: (-s.force_N[0], *s.force_N[1:]))
SMALL = altered(FakeJointEncoder, position_rad=lambda s: tuple(q / 57.2958 for q in s.position_rad))


def set_paused(self: Any) -> None:
    self.paused = True


def rezeroed(self: Any, now_ns: int, sequence: int) -> Any:
    """After a pause the sensor begins at zero again."""
    sample = FakeForceSensor._measured(self, now_ns, sequence)
    return replace(sample, force_N=(0.0, 0.0, 0.0)) if getattr(self, "paused", False) else sample


def set_failed(self: Any, cause: str = "overload") -> None:
    self.paused = True
    self._latch(cause)


def lost(self: Any, now_ns: int, sequence: int) -> Any:
    """After a fault the encoder counts from zero."""
    sample = FakeJointEncoder._measured(self, now_ns, sequence)
    return replace(sample, position_rad=(0.0,) * 3) if getattr(self, "paused", False) else sample


SWAPS_PULLS = altered(FakeForceSensor, force_N=lambda s: s.force_N if min(s.force_N[:2]) >= 0.0 else s.force_N[::-1])
ABSOLUTE = altered(FakeForceSensor, torque_Nm=lambda s: tuple(map(abs, s.torque_Nm)))

CLIPS = altered(FakeForceSensor, force_N=lambda s: tuple(max(-11.0, min(11.0, f)) for f in s.force_N))
INSENSITIVE = altered(FakeForceSensor, force_N=lambda s: tuple(f if abs(f) > 2.0 else 0.0 for f in s.force_N))
LARGEST = altered(
    FakeForceSensor,
    force_N=lambda s: tuple(f if k == max(range(3), key=lambda i: abs(s.force_N[i])) else 0.0
                            for k, f in enumerate(s.force_N)),
)  # fmt: skip
EITHER = altered(FakeForceSensor, torque_Nm=lambda s: (0.0,) * 3 if any(s.force_N) else s.torque_Nm)

FORCE, ENCODER, ARM = fake.TestFakeForceSensor, fake.TestFakeJointEncoder, fake.TestFakeArm
CLOCK, DEADLINES = fake.TestFakeClock, "absolute_deadlines_do_not_drift"
SENSOR, PLAIN = FakeForceSensor, FakeArm
BY_ITSELF: dict[str, Any] = {"runs_by_itself": True}
UNKNOWN: dict[str, Any] = {"expected_rad": None, "turn_by_hand": None}
BLOCK, RELEASE, AJAR = "calls_do_not_block", "close_releases", "failed_configure_leaves_nothing_open"
TARE, LOAD = "no_hidden_tare", "load_is_reported_in_newtons_on_its_axis"
TORQUE, FOLLOW = "torque_is_reported_in_newton_metres_on_its_axis", "encoders_follow_each_joint"
STILL, DROPPED, HELD = "after_stop_the_arm_holds_still", "command_under_way_is_dropped", "stop_holds_the_pose_of_now"
REST, COUNTS, LIFE = "motion_ends_and_does_not_resume", "each_command_counts", "life_goes_by_the_table"
STAND, STOPPED = "angles_are_where_the_joints_stand", "after_stop_send_applies_nothing"
HAND, THREAD, EVERY = "angles_follow_a_hand", "stop_works_from_another_thread", "stop_works_in_every_state"
PLACED, MIDDLE = "turned_by_hand_it_stays_where_it_is_activated", "stop_in_the_middle_of_send_is_not_overtaken"
RANGE, LATCHED = "what_is_beyond_the_range_is_marked", "fault_latches"
CUT, SILENT, SOUND = "lost_device_raises", "silence_is_not_passed_off_as_news", "every_sample_is_sound"
BOUNDS, SPEED = "position_limit_is_applied_and_told", "velocity_limit_is_applied_and_told"

LISTED: list[tuple[Any, Any, dict[str, Any], str]] = [
    (FORCE, unsafe(SENSOR, "Bye", _on_close=first(ask, "_on_close", SENSOR)), {}, "close_works_once_the_cable_is_cut"),
    (FORCE, unsafe(SENSOR, "OpensThenChecks", _on_configure=first(opened, "_on_configure", SENSOR)), {}, AJAR),
    (FORCE, unsafe(SENSOR, "ConfiguresNothing", _on_configure=configure_blindly), {}, AJAR),
    (FORCE, OpensTwice, {}, RELEASE),
    (FORCE, unsafe(SENSOR, "OpensOnceMore", configure=first(opened, "configure", SENSOR)), {}, RELEASE),
    (FORCE, LeavesThread, {}, "close_leaves_no_thread"),
    (FORCE, unsafe(SENSOR, "SlowReading", read=first(slow, "read", SENSOR)), {}, BLOCK),
    (FORCE, SlowByTheWall, {}, BLOCK),
    (FORCE, AwaitsNews, {}, BLOCK),
    (ARM, unsafe(PLAIN, "SlowSending", send=first(slow, "send")), {}, BLOCK),
    (FORCE, AwaitsTheSilent, {}, "silence_is_not_passed_off_as_news"),
    (FORCE, NowAndThen, {}, "every_sample_is_sound"),
    (FORCE, EverySecondIsOld, {}, "load_is_reported_in_newtons_on_its_axis"),
    (FORCE, KeepsItOverAPause, {}, LIFE),
    (FORCE, CountsReadings, BY_ITSELF, "reading_twice_gives_the_same_sample"),
    (FORCE, altered(SENSOR, frame=lambda _: "base"), {}, "every_sample_is_sound"),
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
    (ARM, unsafe(PLAIN, "StopNeverReturns", stop=first(sleepy, "stop")), {}, EVERY),
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
    (ARM, StopForgetsFault, {}, LATCHED),
    (ARM, DropsEverySecond, {}, COUNTS),
    (ARM, SwapsMoves, {}, COUNTS),
    (ARM, MovesUnasked, {}, "wrong_number_of_joints_is_refused"),
    (ARM, unsafe(MovesUnasked, "MovesWhileFaulted", refused_in=Life.FAULTED), {}, LATCHED),
    (ARM, unsafe(MovesUnasked, "MovesWhileDeactivated", refused_in=Life.CONFIGURED), {}, LIFE),
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
    (FORCE, unsafe(SENSOR, "TaresAfterAFault", _measured=rezeroed, fail=set_failed), {}, TARE),
    (FORCE, KeepsItOverAFault, {}, LATCHED),
    (ENCODER, unsafe(FakeJointEncoder, "ZeroAfterAFault", _measured=lost, fail=set_failed), {}, STAND),
    (ENCODER, NewAgainInTheEnd, {}, "silence_is_not_passed_off_as_news"),
    (ARM, KeepsOneLimitAtATime, {}, BOUNDS),
    (ARM, CreepsPastItsLimit, {}, BOUNDS),
    (ARM, JumpsToItsLimit, {}, SPEED),
    (ARM, SavesUpHaste, {}, SPEED),
    (ARM, HangsNowAndThen, {}, BLOCK),
    (ARM, StopToggles, {}, STOPPED),
    (ARM, RefusalEndsStop, {}, STOPPED),
    (ARM, RemembersWhatItRefused, {}, LIFE),
    (ARM, ClosesTowardsHome, {}, REST),
    (FORCE, SWAPS_PULLS, {}, LOAD),
    (FORCE, ABSOLUTE, {}, TORQUE),
    (FORCE, CLIPS, {}, RANGE),
    (FORCE, INSENSITIVE, {}, LOAD),
    (FORCE, LARGEST, {}, LOAD),
    (FORCE, EITHER, {}, TORQUE),
    (FORCE, ZeroesItself, {}, TARE),
    (FORCE, ZeroNowAndThen, {}, TARE),
    (ARM, RemembersWhatItSwallowed, {}, HELD),
    (ARM, SwallowsSmallSteps, {}, COUNTS),
    (ARM, unsafe(MovesUnasked, "MovesWhileClosed", refused_in=Life.CLOSED), {}, LIFE),
    (ARM, StopsForItsThreadOnly, {}, THREAD),
    (ARM, HearsItsThreadOnly, {}, THREAD),
    (ARM, StopWaitsForTheLoop, {}, THREAD),
    (ARM, FaultRunsOutItsMotion, {}, DROPPED),
    (ARM, TakesTheShortWayRound, {}, SPEED),
    (FORCE, ClipsTorque, {}, "torque_beyond_the_range_is_marked"),
    (ENCODER, WrapsAtOneTurn, {}, HAND),
    (ENCODER, OneJointATick, {}, HAND),
    (ENCODER, SleepsWithTheArm, {}, HAND),
    (ENCODER, WakesWhereItFellAsleep, {}, HAND),
    (ENCODER, Sticks, {}, HAND),
    (ENCODER, SlipsNowAndThen, {}, "every_sample_is_sound"),
    (FORCE, CountsFromZeroAgain, {}, LIFE),
    (FORCE, ClockRunsSlow, {}, "every_sample_is_sound"),
    (FORCE, OverloadShiftsItsZero, {}, RANGE),
    (ARM, FaultWearsOff, {}, LATCHED),
    (ARM, YieldsToPersistence, {}, LATCHED),
    (ARM, SendOutlastsStop, {}, MIDDLE),
    (ARM, StopReopens, {}, EVERY),
    (ARM, Parks, {}, DROPPED),
    (ARM, GoesBackToWhereItWas, {}, PLACED),
    (ARM, LimitsFromWhereItWas, {}, PLACED),
    (ARM, CannotLeaveItsLimit, {}, BOUNDS),
    # What changes in the course of a life, and what only a long run finds.
    (ARM, lives.QueueAfterSecondFault, {}, LATCHED),
    (ARM, lives.DeafAfterFault, {}, LATCHED),
    (ARM, lives.MirroredAfterFault, {}, LATCHED),
    (ARM, lives.LatchesOnce, {}, LATCHED),
    (ARM, lives.LatchesInMotionOnly, {}, LATCHED),
    (ARM, lives.StopRenamesFault, {}, LATCHED),
    (ARM, lives.FaultFades, {}, LATCHED),
    (ARM, lives.SaysError, {}, LATCHED),
    (ARM, lives.LimitlessAfterFault, {}, BOUNDS),
    (ARM, lives.LimitlessInSecondTrial, {}, BOUNDS),
    (ARM, lives.ShiftsAtFourthTrial, {}, LIFE),
    (ARM, lives.RunsOnAfterThirdTrial, {}, LIFE),
    (ARM, lives.HomesWhenConfigured, {}, LIFE),
    (ARM, lives.FallsWhenStoppedAtRest, {}, LIFE),
    (ARM, lives.AcknowledgingFrees, {}, LIFE),
    (ARM, lives.ActivatingFrees, {}, LIFE),
    (ARM, lives.ConfiguringFrees, {}, LIFE),
    (ARM, lives.Nameless, {}, LIFE),
    (ARM, lives.KeepsThreadAfterFault, {}, "close_leaves_no_thread"),
    (ARM, lives.StaysOpenAfterFault, {}, RELEASE),
    (ARM, lives.CutTold, {}, CUT),
    (ARM, unsafe(lives.CutTold, "CutToldNoCause", told=("fake arm", "")), {}, CUT),
    (ARM, lives.CutOnce, {}, CUT),
    (ARM, lives.MovesOnWithoutCable, {}, CUT),
    (ARM, lives.SlowStop, {}, EVERY),
    (ENCODER, lives.ShiftsAtSixthTrial, {}, LIFE),
    (ENCODER, lives.ClockSetBack, {}, LIFE),
    (ENCODER, lives.ReadsFaulted, {}, LATCHED),
    (ENCODER, lives.LastKnown, {}, CUT),
    (FORCE, lives.SwapsInSecondTrial, {}, LIFE),
    (FORCE, lives.TaresAtFourthTrial, {}, LIFE),
    (FORCE, lives.SaysTaredInSecondTrial, {}, LIFE),
    (FORCE, lives.FaultUnreadable, {}, LIFE),
    (FORCE, lives.SwapsTorqueAfterFault, {}, LATCHED),
    (FORCE, lives.YieldsAtSecondFault, {}, LATCHED),
    (FORCE, lives.TaresTorque, {}, TARE),
    (FORCE, lives.MarksInFirstTrialOnly, {}, RANGE),
    (FORCE, lives.FailedLeavesThread, {}, AJAR),
    (FORCE, lives.CutSaysError, {}, CUT),
    (FORCE, lives.AwakeInSilence, {}, SILENT),
    (FORCE, lives.ZerosAtFirst, {}, SILENT),
    (ARM, runs.LosesOneIn, {}, COUNTS),
    (ARM, runs.LosesOneInThousand, {}, COUNTS),
    (ARM, runs.TellsAnother, {}, COUNTS),
    (ARM, runs.ReplaysOne, {}, COUNTS),
    (ARM, runs.SwapsJointsTogether, {}, COUNTS),
    (ARM, runs.PausesNowAndThen, {}, COUNTS),
    (ARM, runs.SpeedsUpLater, {}, SPEED),
    (ARM, runs.DeafAfterAMinute, {}, STILL),
    (ARM, runs.StopEndsAtFiftiethLook, {}, STILL),
    (ARM, runs.StopEndsAtFiftiethSend, {}, STILL),
    (ARM, runs.Sinks, {}, STILL),
    (ARM, runs.SinksLate, {}, STILL),
    (ARM, runs.SinksUntold, {}, "activation_does_not_move_the_arm"),
    (ENCODER, runs.Altering, {}, SOUND),
    (ENCODER, runs.JumpsATurn, {}, SOUND),
    (ENCODER, runs.CountsTwice, {}, SOUND),
    (ENCODER, runs.PassesOnNan, {}, SOUND),
    (ENCODER, runs.MixesInAnOldJoint, {}, SOUND),
    (ENCODER, runs.LateNowAndThen, {}, SOUND),
    (ENCODER, runs.StaleIsZero, {}, SILENT),
    (FORCE, runs.AlteringForce, {}, SOUND),
    (FORCE, runs.PassesOnNanTorque, {}, SOUND),
    (FORCE, runs.ChangesFrame, {}, SOUND),
    (FORCE, runs.OldUnderNewNumber, {}, SOUND),
    (FORCE, runs.TaresLater, {}, SOUND),
    (FORCE, runs.TimeOf32Bits, {}, SOUND),
    (FORCE, runs.CountsUntilSilent, {}, "reading_twice_gives_the_same_sample"),
    (CLOCK, runs.WakesEarlyAtTimes, {}, DEADLINES),
    (CLOCK, runs.OversleepsAtTimes, {}, DEADLINES),
    (FORCE, careless.FifoAfterAPause, {}, SOUND),
    (FORCE, careless.Crosstalk, {}, LOAD),
    (FORCE, careless.Deadband, {}, LOAD),
    (FORCE, careless.MarkedOnce, {}, RANGE),
    (ENCODER, careless.SixteenBits, {"long_ticks": 70_000}, SOUND),
    (ARM, careless.MasksAtStart, {}, LATCHED),
    (ARM, careless.StopsWhileLed, {}, STOPPED),
    (ARM, careless.SwallowsTenthOfMilliradian, {}, COUNTS),
    (ARM, careless.StaysOpenOnceStopped, {}, RELEASE),
    (CLOCK, careless.Rough, {}, DEADLINES),
    (CLOCK, careless.SleepsInPieces, {}, DEADLINES),
    (CLOCK, careless.JumpsOnce, {}, "time_never_goes_back"),
    (CLOCK, careless.SleepsOnTheDeadlineGone, {}, "past_deadline_returns_at_once"),
]
UNSAFE = [(suite, kind, knobs, f"test_{clause}") for suite, kind, knobs, clause in LISTED]
