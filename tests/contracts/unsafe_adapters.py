"""Adapters that would hurt somebody, each a good fake with one thing overridden, and the clause that has to say so.

What `broken_arms` and `broken_sensors` have already is not here again.
"""

from typing import Any

from palpate.core.ports import Life
from tests.contracts import test_fake as fake
from tests.contracts import unsafe_arms as arms
from tests.contracts import unsafe_careless as careless
from tests.contracts import unsafe_lives as lives
from tests.contracts import unsafe_long_runs as runs
from tests.contracts import unsafe_plugs as plugs
from tests.contracts import unsafe_readings as readings
from tests.contracts import unsafe_stops as stops
from tests.contracts.broken_sensors import CountsReadings
from tests.contracts.unsafe_arms import left_moving, only_said
from tests.contracts.unsafe_readings import (
    ask,
    first,
    frozen,
    lost,
    opened,
    rezeroed,
    set_failed,
    set_paused,
    sleepy,
    slow,
    unsafe,
)
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder

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
PLUGGED, PAST, ALONE = (
    "plugged_in_again_all_is_as_before",
    "past_deadline_returns_at_once",
    "activation_does_not_move_the_arm",
)
BOUNDS, SPEED = "position_limit_is_applied_and_told", "velocity_limit_is_applied_and_told"

LISTED: list[tuple[Any, Any, dict[str, Any], str]] = [
    (FORCE, unsafe(SENSOR, "Bye", _on_close=first(ask, "_on_close", SENSOR)), {}, "close_works_once_the_cable_is_cut"),
    (FORCE, unsafe(SENSOR, "OpensThenChecks", _on_configure=first(opened, "_on_configure", SENSOR)), {}, AJAR),
    (FORCE, readings.OpensTwice, {}, RELEASE),
    (FORCE, unsafe(SENSOR, "OpensOnceMore", configure=first(opened, "configure", SENSOR)), {}, RELEASE),
    (FORCE, readings.LeavesThread, {}, "close_leaves_no_thread"),
    (FORCE, unsafe(SENSOR, "SlowReading", read=first(slow, "read", SENSOR)), {}, BLOCK),
    (FORCE, readings.SlowByTheWall, {}, BLOCK),
    (FORCE, readings.AwaitsNews, {}, BLOCK),
    (ARM, unsafe(PLAIN, "SlowSending", send=first(slow, "send")), {}, BLOCK),
    (FORCE, readings.AwaitsTheSilent, {}, "silence_is_not_passed_off_as_news"),
    (FORCE, readings.EverySecondIsOld, {}, "load_is_reported_in_newtons_on_its_axis"),
    (FORCE, CountsReadings, BY_ITSELF, "reading_twice_gives_the_same_sample"),
    (FORCE, readings.MIRRORED, {}, "pressing_on_the_tip_gives_negative_fz"),
    (ENCODER, readings.FIRST_FLIPPED, UNKNOWN, FOLLOW),
    (ENCODER, readings.SWAPPED, UNKNOWN, FOLLOW),
    (ENCODER, unsafe(FakeJointEncoder, "Frozen", _measured=frozen), {}, FOLLOW),
    (
        ARM,
        unsafe(PLAIN, "StopAsksTheArm", stop=first(ask, "stop")),
        {"reconnect": None},
        "stop_works_once_the_cable_is_cut",
    ),
    (ARM, unsafe(PLAIN, "StopSendsNothing", stop=only_said), {}, DROPPED),
    (ARM, unsafe(PLAIN, "StopNeverReturns", stop=first(sleepy, "stop")), {}, EVERY),
    (ARM, unsafe(PLAIN, "DeactivateLeavesItMoving", _on_deactivate=left_moving), {}, DROPPED),
    (ARM, unsafe(PLAIN, "CloseLeavesItMoving", _on_close=lambda self: setattr(self, "is_open", False)), {}, DROPPED),
    (ARM, arms.HoldsFirstStop, {}, HELD),
    (ARM, arms.SaysItIsAtHome, {}, HELD),
    (ARM, arms.StopWearsOff, {}, STILL),
    (ARM, arms.MovesOnAfterStop, {}, STILL),
    (ARM, arms.Resumes, {}, REST),
    (ARM, unsafe(arms.Resumes, "ResumesAfterFault", after="fault"), {}, REST),
    (ARM, arms.ActivatesAtHome, {}, REST),
    (ARM, arms.StopForgetsFault, {}, LATCHED),
    (ARM, arms.DropsEverySecond, {}, COUNTS),
    (ARM, arms.MovesUnasked, {}, "wrong_number_of_joints_is_refused"),
    (ARM, unsafe(arms.MovesUnasked, "MovesWhileFaulted", refused_in=Life.FAULTED), {}, LATCHED),
    (ARM, unsafe(arms.MovesUnasked, "MovesWhileDeactivated", refused_in=Life.CONFIGURED), {}, LIFE),
    (ARM, unsafe(arms.OnlyBounds, "NoLowerLimit", absent=(("_lower_rad", 2),)), {}, BOUNDS),
    (ARM, unsafe(arms.OnlyBounds, "NoLimitOfTheFirst", absent=(("_upper_rad", 0), ("_lower_rad", 0))), {}, BOUNDS),
    (ARM, arms.SaysLimitAndGoesOn, {}, BOUNDS),
    (ARM, arms.AddsUpWithinATick, {}, SPEED),
    (ARM, arms.LimitsTheFirstTickOnly, {}, SPEED),
    (ARM, arms.LimitsOneJoint, {}, SPEED),
    (ARM, arms.StopsOnce, {}, DROPPED),
    (ARM, arms.BrakeLetsGoLate, {}, REST),
    (FORCE, unsafe(SENSOR, "TaresAfterAPause", _measured=rezeroed, _on_deactivate=set_paused), {}, TARE),
    (FORCE, unsafe(SENSOR, "TaresAfterAFault", _measured=rezeroed, fail=set_failed), {}, TARE),
    (ENCODER, unsafe(FakeJointEncoder, "ZeroAfterAFault", _measured=lost, fail=set_failed), {}, STAND),
    (ARM, arms.KeepsOneLimitAtATime, {}, BOUNDS),
    (ARM, arms.SavesUpHaste, {}, SPEED),
    (ARM, arms.HangsNowAndThen, {}, BLOCK),
    (ARM, arms.StopToggles, {}, STOPPED),
    (ARM, arms.RefusalEndsStop, {}, STOPPED),
    (ARM, arms.ClosesTowardsHome, {}, REST),
    (FORCE, readings.SWAPS_PULLS, {}, LOAD),
    (FORCE, readings.ABSOLUTE, {}, TORQUE),
    (FORCE, readings.INSENSITIVE, {}, LOAD),
    (FORCE, readings.EITHER, {}, TORQUE),
    (FORCE, readings.ZeroesItself, {}, TARE),
    (FORCE, readings.ZeroNowAndThen, {}, TARE),
    (ARM, arms.RemembersWhatItSwallowed, {}, HELD),
    (ARM, stops.StopsForItsThreadOnly, {}, THREAD),
    (ARM, stops.HearsItsThreadOnly, {}, THREAD),
    (ARM, stops.FaultRunsOutItsMotion, {}, DROPPED),
    (ARM, stops.TakesTheShortWayRound, {}, SPEED),
    (FORCE, readings.ClipsTorque, {}, "torque_beyond_the_range_is_marked"),
    (ENCODER, readings.WrapsAtOneTurn, {}, HAND),
    (ENCODER, readings.Sticks, {}, HAND),
    (ENCODER, readings.SlipsNowAndThen, {}, "every_sample_is_sound"),
    (FORCE, readings.CountsFromZeroAgain, {}, LIFE),
    (ARM, stops.FaultWearsOff, {}, LATCHED),
    (ARM, stops.SendOutlastsStop, {}, MIDDLE),
    (ARM, stops.StopReopens, {}, EVERY),
    (ARM, stops.Parks, {}, DROPPED),
    (ARM, stops.LimitsFromWhereItWas, {}, PLACED),
    (ARM, stops.CannotLeaveItsLimit, {}, BOUNDS),
    # What changes in the course of a life, and what only a long run finds.
    (ARM, lives.QueueAfterSecondFault, {}, LATCHED),
    (ARM, lives.SaysError, {}, LATCHED),
    (ARM, lives.LimitlessAfterFault, {}, BOUNDS),
    (ARM, lives.LimitlessInSecondTrial, {}, BOUNDS),
    (ARM, lives.RunsOnAfterThirdTrial, {}, LIFE),
    (ARM, lives.HomesWhenConfigured, {}, LIFE),
    (ARM, lives.FallsWhenStoppedAtRest, {}, LIFE),
    (ARM, lives.KeepsThreadAfterFault, {}, "close_leaves_no_thread"),
    (ARM, lives.StaysOpenAfterFault, {}, RELEASE),
    (ARM, lives.CutTold, {}, CUT),
    (ARM, unsafe(lives.CutTold, "CutToldNoCause", told=("fake arm", "")), {}, CUT),
    (ARM, lives.MovesOnWithoutCable, {}, CUT),
    (ARM, lives.SlowStop, {}, EVERY),
    (ENCODER, lives.ClockSetBack, {}, LIFE),
    (FORCE, lives.SaysTaredInSecondTrial, {}, LIFE),
    (FORCE, lives.SwapsTorqueAfterFault, {}, LATCHED),
    (FORCE, lives.TaresTorque, {}, TARE),
    (FORCE, lives.MarksInFirstTrialOnly, {}, RANGE),
    (FORCE, lives.FailedLeavesThread, {}, AJAR),
    (FORCE, lives.CutSaysError, {}, CUT),
    (FORCE, lives.ZerosAtFirst, {}, SILENT),
    (ARM, runs.LosesOneIn, {}, COUNTS),
    (ARM, runs.LosesOneInThousand, {}, COUNTS),
    (ARM, runs.PausesNowAndThen, {}, COUNTS),
    (ARM, runs.SpeedsUpLater, {}, SPEED),
    (ARM, runs.DeafAfterAMinute, {}, STILL),
    (ARM, runs.Sinks, {}, STILL),
    (ARM, runs.SinksLate, {}, STILL),
    (ARM, runs.SinksUntold, {}, "activation_does_not_move_the_arm"),
    (ENCODER, runs.Altering, {}, SOUND),
    (ENCODER, runs.JumpsATurn, {}, SOUND),
    (ENCODER, runs.CountsTwice, {}, SOUND),
    (ENCODER, runs.MixesInAnOldJoint, {}, SOUND),
    (ENCODER, runs.StaleIsZero, {}, SILENT),
    (FORCE, runs.TaresLater, {}, SOUND),
    (FORCE, runs.CountsUntilSilent, {}, "reading_twice_gives_the_same_sample"),
    (FORCE, careless.FifoAfterAPause, {}, SOUND),
    (FORCE, careless.Crosstalk, {}, LOAD),
    (FORCE, careless.Deadband, {}, LOAD),
    (FORCE, careless.MarkedOnce, {}, RANGE),
    (ENCODER, careless.SixteenBits, {"long_ticks": 70_000}, SOUND),
    (ARM, careless.ForgetsBoundsOnceStopped, {}, BOUNDS),
    (ARM, careless.ForgetsSpeedAtSecondFault, {}, SPEED),
    (ARM, careless.MasksAtStart, {}, LATCHED),
    (ARM, careless.StopsWhileLed, {}, STOPPED),
    (ARM, careless.SwallowsTenthOfMilliradian, {}, COUNTS),
    (ARM, careless.StaysOpenOnceStopped, {}, RELEASE),
    (CLOCK, careless.Rough, {}, DEADLINES),
    (CLOCK, careless.SleepsInPieces, {}, DEADLINES),
    (CLOCK, careless.JumpsOnce, {}, "time_never_goes_back"),
    (CLOCK, careless.SleepsOnTheDeadlineGone, {}, PAST),
    # What a cut cable leaves, and what goes wrong beside something else.
    (ARM, plugs.ResumesPlugged, {}, PLUGGED),
    (ARM, plugs.SendsLater, {}, PLUGGED),
    (ARM, plugs.ForgetsStopWithoutCable, {}, PLUGGED),
    (ARM, plugs.FreedPlugged, {}, PLUGGED),
    (ARM, plugs.ClearedPlugged, {}, PLUGGED),
    (ARM, plugs.AcknowledgesStrangely, {}, PLUGGED),
    (ARM, plugs.UnlimitedPlugged, {}, SPEED),
    (FORCE, plugs.NeverOldPlugged, {}, SILENT),
    (FORCE, plugs.UnmarkedPlugged, {}, RANGE),
    (ENCODER, plugs.ForgetsTurnsUnplugged, {}, HAND),
    (ARM, plugs.StopsUnlessClamped, {}, STOPPED),
    (ARM, plugs.CoastsAtSpeed, {}, STOPPED),
    (ARM, plugs.SaysAsAskedWhereItIsHeld, {}, STOPPED),
    (ARM, plugs.FinishesLongAfter, {}, REST),
    (ARM, plugs.EitherLimit, {}, BOUNDS),
    (ARM, plugs.TurnsTwiceAsFast, {}, SPEED),
    (ARM, plugs.LosesFirstCommand, {}, LIFE),
    (ARM, plugs.KeepsAliveWithTheFirst, {}, ALONE),
    (ARM, plugs.KeepsTheFirstOfTwoLikeOnes, {}, "newest_command_wins"),
    (ARM, plugs.NewestCause, {}, LATCHED),
    (ARM, plugs.FailsOnlyActive, {}, LATCHED),
    (ARM, plugs.StopEndsFault, {}, LATCHED),
    (ENCODER, plugs.TimesOut, {}, SILENT),
    (ENCODER, plugs.SleepsWhileStopped, {}, HAND),
    (FORCE, plugs.MirrorsInTension, {}, TORQUE),
    (FORCE, plugs.TaresLittle, {}, TARE),
    (FORCE, plugs.ClipsTogether, {}, "torque_beyond_the_range_is_marked"),
    (FORCE, plugs.RestartsOverloaded, {}, RANGE),
    (FORCE, plugs.QueuesWhilePaused, {}, LIFE),
    (CLOCK, plugs.WrapsAt32Bits, {}, DEADLINES),
    (CLOCK, plugs.SleepsAMillisecondAtLeast, {}, DEADLINES),
]
UNSAFE = [(suite, kind, knobs, f"test_{clause}") for suite, kind, knobs, clause in LISTED]
