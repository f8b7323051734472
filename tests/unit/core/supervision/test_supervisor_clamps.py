"""Commands beyond a joint limit are clamped, and both commands are kept."""

from __future__ import annotations

import pytest

from palpate.core.insertion.expectation import TripReason
from palpate.core.ports.values import AppliedCommand, CommandReason, JointVector
from tests.unit.core.supervision.bench import Bench

REACH_RAD = 1.0 / 140


def with_first(q: JointVector, value: float) -> JointVector:
    return (value, *q[1:])


def test_a_command_that_is_too_fast_is_shortened() -> None:
    bench = Bench()
    bench.clean(2)
    asked = with_first(bench.home_rad, bench.home_rad[0] + 0.02)
    done = bench.tick(asked_rad=asked)
    assert done.intervention is not None
    assert done.intervention.reason is CommandReason.VELOCITY_LIMIT
    assert done.intervention.trip is None
    assert done.intervention.asked_rad == asked
    assert done.intervention.command_rad == done.command.position_rad
    assert done.command.position_rad == with_first(bench.home_rad, pytest.approx(bench.home_rad[0] + REACH_RAD))
    assert bench.applied == AppliedCommand(done.command.position_rad, CommandReason.VELOCITY_LIMIT)
    bench.clean(1, asked_rad=with_first(bench.home_rad, bench.home_rad[0] + 2 * REACH_RAD - 1e-9))


def test_a_command_beyond_a_position_limit_ends_there() -> None:
    bench = Bench()
    edge = (0.0, 1.699, -1.42, 0.0, 0.55, 0.0)
    bench.tick(measured_rad=edge, asked_rad=edge, tip_m=None)
    done = bench.tick(measured_rad=edge, asked_rad=(0.0, 1.703, -1.42, 0.0, 0.55, 0.0), tip_m=None)
    assert done.intervention is not None
    assert done.intervention.reason is CommandReason.POSITION_LIMIT
    assert done.command.position_rad == (0.0, 1.7, -1.42, 0.0, 0.55, 0.0)
    assert bench.supervisor.trip is None


def test_an_arm_that_stands_outside_by_an_encoder_step_is_told_to_come_in() -> None:
    bench = Bench()
    outside = (0.0, 1.7001, -1.42, 0.0, 0.55, 0.0)
    done = bench.tick(measured_rad=outside, asked_rad=outside, tip_m=None)
    assert bench.supervisor.trip is None
    assert done.command.position_rad == (0.0, 1.7, -1.42, 0.0, 0.55, 0.0)


def test_it_goes_on_from_what_the_arm_really_did() -> None:
    bench = Bench()
    bench.clean(2)
    bench.tick(asked_rad=with_first(bench.home_rad, bench.home_rad[0] + 7e-3))
    bench.applied = AppliedCommand(bench.home_rad, CommandReason.VELOCITY_LIMIT)
    done = bench.tick(asked_rad=with_first(bench.home_rad, bench.home_rad[0] + 14e-3))
    assert done.command.position_rad[0] == pytest.approx(bench.home_rad[0] + REACH_RAD)


def test_the_arms_own_reason_goes_before_the_clamps() -> None:
    bench = Bench()
    bench.clean(2)
    done = bench.tick(asked_rad=with_first(bench.home_rad, bench.home_rad[0] + 0.02))
    stopped = AppliedCommand(bench.home_rad, CommandReason.STOPPED)
    assert done.applied(stopped) is stopped


def test_a_trip_is_no_reason_of_the_arm() -> None:
    bench = Bench()
    bench.clean(2)
    done = bench.tick(force_N=(0, 0, -50.0))
    assert done.intervention is not None
    assert done.intervention.reason is TripReason.FORCE_LIMIT
    assert bench.applied == AppliedCommand(done.command.position_rad)
