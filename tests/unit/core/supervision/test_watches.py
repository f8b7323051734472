"""What builds up over ticks before it trips: rates, lags, silence, motion; and commands that no arm may get."""

from math import nan
from typing import Any

import pytest

from palpate.core.ports.values import AppliedCommand, CommandReason, Validity
from palpate.core.supervision.config import SupervisionConfig
from palpate.core.trial.expectation import Expectation, TripReason
from tests.unit.core.supervision.bench import UNTARED, Bench

MS = 1_000_000
TICK_NS = 1_000_000_000 // 140


# Rates.


def test_the_force_may_change_so_fast_and_no_faster() -> None:
    bench = Bench()
    bench.clean(3)
    bench.clean(1, force_N=(0, 0, -21.4))  # 21.43 N in a period are 3000 N/s
    trip = bench.trip(force_N=(0, 0.0, 0.1))
    assert (trip.reason, trip.tick) == (TripReason.FORCE_RATE, 4)
    assert trip.text == "force changed at 3010 N/s, limit 3000 N/s"


def test_a_rate_counts_from_new_sample_to_new_sample() -> None:
    """Two periods lie between the samples; the repeated one in between says nothing."""
    bench = Bench()
    bench.clean(3)
    old = bench.snapshots[-1].wrench
    bench.clean(1, wrench={"sequence": old.sequence, "source_time_ns": old.source_time_ns})
    bench.clean(1, force_N=(0, 0, -29.0))
    assert bench.trip(force_N=(0, 0, 0.0)).reason is TripReason.FORCE_RATE


# Contact where none is expected, before the sensor is tared.


def test_before_taring_contact_is_a_change_since_the_free_phase_began() -> None:
    free = Expectation(contact=False)
    bench = Bench()
    # The arm lifts out of a hole: the force of the first sample goes, and is no contact.
    for force in (-5.0, -5.0, -2.0, 0.0):
        bench.clean(1, force_N=(0, 0, force), expectation=UNTARED)
    bench.clean(3, expectation=free)
    bench.clean(1, force_N=(0, 0, -2.9), expectation=free)
    assert bench.trip(force_N=(0, 0, -3.1), expectation=free).reason is TripReason.UNEXPECTED_CONTACT


def test_every_free_phase_begins_anew() -> None:
    free = Expectation(contact=False)
    bench = Bench()
    bench.clean(2, expectation=free)
    bench.clean(1, expectation=UNTARED, force_N=(0, 0, -5.0))
    bench.clean(5, expectation=free, force_N=(0, 0, -5.0))
    assert bench.supervisor.trip is None


# Time.


def test_a_tick_may_be_late_and_not_too_late() -> None:
    def late(bench: Bench, ms: float) -> dict[str, Any]:
        now = bench.snapshots[-1].time_ns + round(ms * MS)
        news = {"source_time_ns": now, "receive_time_ns": now}
        return {"time_ns": now, "wrench": news, "joints": news}

    bench = Bench()
    bench.clean(3)
    bench.clean(1, **late(bench, 49.9))
    trip = bench.trip(**late(bench, 50.1))
    assert (trip.reason, trip.tick) == (TripReason.LATE_CYCLE, 4)
    assert trip.text == "time since the last tick 50.1 ms, limit 50 ms"
    bench = Bench()
    bench.clean(3)
    assert bench.trip(**late(bench, -1.0)).reason is TripReason.LATE_CYCLE


@pytest.mark.parametrize("which", ["wrench", "joints"])
def test_a_sensor_may_repeat_itself_fourteen_times(which: str) -> None:
    bench = Bench(SupervisionConfig())
    bench.clean(1)
    bench.clean(14, **{which: {"sequence": 0}})
    bench.clean(1)
    bench.clean(14, **{which: {"sequence": 15}})
    trip = bench.trip(**{which: {"sequence": 15}})
    name = "force" if which == "wrench" else "joint"
    assert (trip.reason, trip.tick, trip.sample) == (TripReason.SAMPLE_REPEATED, 30, name)
    assert trip.text == f"no new {name} sample for 15 ticks, limit 14 ticks"


def test_a_sensor_that_counts_on_and_never_changes_is_frozen() -> None:
    bench = Bench(noisy=True)
    bench.clean(6)
    bench.clean(6, torque_Nm=(0, 0, 1e-15))  # one channel differs in its last bits: it lives
    number = bench.snapshots[-1].wrench.sequence
    bench.clean(3, torque_Nm=(0, 0, 1e-15), wrench={"sequence": number})  # no news, counted elsewhere
    trip = bench.trip(torque_Nm=(0, 0, 1e-15))
    assert (trip.reason, trip.tick, trip.sample) == (TripReason.SAMPLE_FROZEN, 15, "force")
    assert trip.text == "6 new force samples in a row are equal to the one before in every bit, limit 5"


# Joints.


def moving(bench: Bench, speed_rad_s: float, ticks: int, joint: int = 0) -> None:
    """Commands at a steady speed, followed by the arm, until something happens."""
    for _ in range(ticks):
        asked = tuple(q + speed_rad_s / 140 * (i == joint) for i, q in enumerate(bench.here_rad))
        bench.tick(asked_rad=asked)


def test_the_fastest_motion_that_the_arm_is_allowed_is_no_fault() -> None:
    bench = Bench()
    bench.clean(2)
    moving(bench, 1.0 - 1e-9, 200)
    assert bench.supervisor.trip is None


def test_a_joint_that_runs_away_trips() -> None:
    """1.3 rad/s, limit 1.2, from differences over four periods: seen when all of the window is motion."""
    bench = Bench(SupervisionConfig(max_tracking_error_mrad=500.0, weakened=("max_tracking_error_mrad",)))
    bench.clean(6)
    home = bench.home_rad
    for n in range(1, 20):
        bench.tick(measured_rad=(home[0] + n * 1.3 / 140, *home[1:]), asked_rad=home)
        if bench.supervisor.trip is not None:
            break
    trip = bench.tripped
    assert (trip.reason, n) == (TripReason.JOINT_VELOCITY, 4)
    assert trip.text == "joint 1 moves at 1.300 rad/s, limit 1.200 rad/s"


def test_steps_of_the_encoder_and_repeated_samples_are_no_velocity() -> None:
    """A step of 20 mrad between two samples would be 2.8 rad/s; over the window it is 0.7."""
    bench = Bench(SupervisionConfig(max_tracking_error_mrad=500.0, weakened=("max_tracking_error_mrad",)))
    home = bench.home_rad
    bench.clean(6)
    for tick in range(40):
        step = 20e-3 * (tick // 8)
        bench.clean(1, measured_rad=(home[0] + step, *home[1:]), asked_rad=home)
    old = bench.snapshots[-1].joints
    again = {"source_time_ns": old.source_time_ns}  # a new number on an old time
    bench.clean(1, measured_rad=(home[0] + 0.2, *home[1:]), asked_rad=home, joints=again)


def test_an_arm_may_lag_by_so_many_ticks() -> None:
    """At 1 rad/s three ticks are 21 mrad: more than the tolerance, and no fault; four ticks and 10 mrad are one."""

    def lagging(lag: int, extra_rad: float, *, old: int = 0) -> Bench:
        bench = Bench()
        bench.clean(10)
        sent = [bench.home_rad] * 10
        for _ in range(30):
            measured = sent[-1 - lag - old]
            asked = (sent[-1][0] + 0.999 / 140, *sent[-1][1:])
            told = {"source_time_ns": bench.snapshots[-1].time_ns - (old - 1) * TICK_NS}
            bench.tick(measured_rad=(measured[0] - extra_rad, *measured[1:]), asked_rad=asked, joints=told)
            sent.append(bench.results[-1].command.position_rad)
        return bench

    assert lagging(3, 9.9e-3).supervisor.trip is None
    assert lagging(3, 10.2e-3).tripped.reason is TripReason.TRACKING_ERROR
    assert lagging(5, 0.0).supervisor.trip is not None
    # By the commands of the time at which it was measured, and so far back only.
    assert lagging(3, 9.9e-3, old=2).supervisor.trip is None
    assert lagging(3, 10.2e-3, old=2).supervisor.trip is not None
    assert lagging(3, 9.9e-3, old=6).supervisor.trip is not None


# Commands.


def test_a_jump_trips_and_is_not_sent() -> None:
    bench = Bench()
    bench.clean(3)
    home = bench.home_rad
    done = bench.tick(asked_rad=(home[0] + 0.0501, *home[1:]))
    trip = bench.tripped
    assert (trip.reason, trip.tick) == (TripReason.COMMAND_JUMP, 3)
    assert trip.text == "a joint's command jumps by 50.1 mrad, limit 50 mrad"
    assert abs(done.command.position_rad[0] - home[0]) < 1e-3
    assert done.intervention is not None
    assert done.intervention.asked_rad[0] == home[0] + 0.0501


@pytest.mark.parametrize(
    ("answer", "said"), [((nan,) * 6, "6 joint angles that are not finite"), ((0.1,) * 5, ""), ((), "")]
)
def test_an_arm_that_says_nonsense_trips(answer: tuple[float, ...], said: str) -> None:
    bench = Bench()
    bench.clean(3)
    bench.applied = AppliedCommand(answer, CommandReason.VELOCITY_LIMIT)
    done = bench.tick(measured_rad=bench.home_rad, asked_rad=bench.home_rad)
    trip = bench.tripped
    assert trip.reason is TripReason.COMMAND_NOT_FINITE
    assert f"what the arm says that it applied has {said}" in trip.text
    assert done.command.position_rad == pytest.approx(bench.home_rad, abs=1e-3)


def test_the_first_cause_is_the_one_that_is_kept() -> None:
    bench = Bench()
    bench.clean(3)
    bench.tick(force_N=(0, 0, -90.0), tip_m=(1.0, 0.0, 0.0))
    first = bench.supervisor.trip
    bench.tick(wrench={"validity": Validity.INVALID})
    assert first is not None
    assert first.reason is TripReason.FORCE_LIMIT
    assert bench.supervisor.trip is first


def test_a_joint_that_shows_one_angle_while_its_commands_go_on_is_found() -> None:
    bench = Bench()
    bench.clean(10)
    for tick in range(40):
        asked = (bench.home_rad[0] + 2e-4 * tick, *bench.home_rad[1:])
        bench.tick(measured_rad=bench.home_rad, asked_rad=asked)
    assert bench.tripped.reason is TripReason.TRACKING_ERROR
    assert "stays at" in bench.tripped.text
