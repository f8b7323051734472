"""Commands are clamped; after a trip, which latches, the arm is led back or held until a person acknowledges."""

from itertools import pairwise
from math import tau

import numpy as np
import pytest

from palpate.core.errors import ConfigurationError, DeviceError, FaultLatchedError, LifecycleError
from palpate.core.motion import Kinematics, arm_named
from palpate.core.ports.latch import Acknowledgement, FaultLatch
from palpate.core.ports.values import AppliedCommand, CommandReason, JointCommand, Validity, WrenchKind
from palpate.core.supervision.config import SupervisionConfig
from tests.unit.core.fake_world import TOOL, ready_pose
from tests.unit.core.motion.limits import within_limits
from tests.unit.core.supervision.bench import FREE, Bench, supervisor

HIT = {"force_N": (0, 0, -31.0), "wrench": {"sequence": 10_000}}
HOLD = SupervisionConfig(on_trip="hold", weakened=("on_trip",))
ARMS = ("zebra-zero", "ur5", "panda")


def hit(config=None, arm="zebra-zero", **more):
    """A bench that has just tripped."""
    bench = Bench(config, arm, **more)
    bench.clean(1, force_N=(0, 0, -20.0))
    bench.tick(**HIT)
    assert bench.supervisor.trip is not None
    return bench


def tips(bench, commands, arm="zebra-zero"):
    kinematics = Kinematics(arm_named(arm), TOOL)
    found = []
    for q in commands:
        kinematics.update(q)
        found.append(kinematics.tip_position_m.copy())
    return np.array(found)


def test_without_a_trial_there_is_no_command():
    bench = Bench()
    with pytest.raises(LifecycleError, match=r"call begin\(\) first"):
        supervisor().check(bench.snapshot(), JointCommand(bench.home_rad), FREE)


def test_trip_latches_until_it_is_acknowledged():
    bench = hit(HOLD)
    guard = bench.supervisor
    trip = guard.trip
    assert not guard.retracting
    held = bench.results[-1].command
    for _ in range(50):
        done = bench.tick(requested_rad=tuple(q + 1e-3 for q in bench.home_rad))
        assert done.command == held
        assert done.command_override.trip is trip
    with pytest.raises(
        FaultLatchedError, match=r"supervisor: stopped by a fault \(FORCE_LIMIT: force 31.00 N, limit 30 N\)"
    ):
        guard.begin()
    guard.latch.acknowledge("a person", "it was a test")
    guard.begin()
    assert guard.trip is None
    bench.snapshots.clear()
    bench.applied = None
    bench.clean(20)


def test_latch_holds_whoever_watches_the_rig_next_until_somebody_acknowledges_by_name():
    latch = FaultLatch()
    bench = Bench(latch=latch)
    bench.trip(force_N=(0, 0, -31.0))
    with pytest.raises(FaultLatchedError, match=r"force 31.00 N, limit 30 N"):
        Bench(latch=latch)
    for by, reason, field in (("  ", "the plate is gone", "by"), ("Ada", " ", "reason")):
        with pytest.raises(ConfigurationError, match=f"acknowledgement.{field} must be "):
            latch.acknowledge(by, reason)
    latch.acknowledge("Ada", "the plate is gone")
    assert latch.acknowledgements == [
        Acknowledgement("Ada", "the plate is gone", "FORCE_LIMIT: force 31.00 N, limit 30 N")
    ]
    Bench(latch=latch).clean(3)
    bench.supervisor.begin()
    assert bench.supervisor.trip is None
    with pytest.raises(LifecycleError, match="there is no trip"):
        latch.acknowledge("Ada", "once more")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"frame": "base"}, "raw wrenches in the frame 'base'"),
        ({"kind": WrenchKind.GRAVITY_COMPENSATED}, "gravity compensated wrenches"),
    ],
)
def test_wrenches_that_are_not_as_agreed_are_refused_before_anything_moves(change, words):
    bench = Bench()
    with pytest.raises(DeviceError, match=f"force sensor: {words}.*; the task requires raw wrenches in 'sensor'"):
        bench.tick(wrench=change)
    assert bench.results == []


def test_there_is_nothing_to_acknowledge_without_a_trip():
    bench = Bench()
    with pytest.raises(LifecycleError, match=r"acknowledge\(\) is not possible while active; there is no trip"):
        bench.supervisor.latch.acknowledge("a person", "it was a test")
    with pytest.raises(LifecycleError):
        bench.supervisor.retreat(bench.snapshot())


def test_trial_may_follow_a_trial():
    bench = Bench()
    bench.clean(5, force_N=(0, 0, -20.0))
    bench.supervisor.begin()
    bench.snapshots.clear()
    bench.applied = None
    bench.clean(5, force_N=(0, 0, 19.0))  # no rate from trial to trial, and ticks from 0 are not late


@pytest.mark.parametrize("arm", ARMS)
def test_it_retracts_straight_back_along_the_tool_axis_and_ends(arm):
    bench = hit(arm=arm)
    guard = bench.supervisor
    ticks = 1
    while guard.retracting:
        bench.tick()
        ticks += 1
    assert ticks == 105  # 15 mm at 20 mm/s and 140 Hz
    commands = [bench.home_rad, *(done.command.position_rad for done in bench.results[1:])]
    kinematics = Kinematics(arm_named(arm), TOOL)
    kinematics.update(bench.home_rad)
    axis, rotation = kinematics.tip_rotation[:, 2].copy(), kinematics.tip_rotation.copy()
    way = tips(bench, commands, arm) - kinematics.tip_position_m
    along = -way @ axis
    np.testing.assert_allclose(np.diff(along)[:-1], 20e-3 / 140, rtol=1e-3)
    assert along[-1] == pytest.approx(15e-3, abs=1e-5)
    assert np.abs(way + np.outer(along, axis)).max() < 1e-6
    kinematics.update(commands[-1])
    np.testing.assert_allclose(kinematics.tip_rotation, rotation, atol=1e-5)
    reach = kinematics.velocity_limit_rad_s / 140 * (1 + 1e-9)
    for before, after in pairwise(commands):
        assert (np.abs(np.array(after) - before) <= reach).all()
        assert within_limits(kinematics, after)
    last = bench.results[-1].command
    assert bench.tick().command == last


def test_retraction_pulls_a_stuck_peg_by_at_most_the_force_limit():
    bench = hit(axial_N_per_m=20e3)
    while bench.supervisor.retracting:
        bench.tick()
    start_m, end_m = tips(bench, [bench.home_rad, bench.results[-1].command.position_rad])
    assert np.linalg.norm(end_m - start_m) * 20e3 == pytest.approx(30.0 + 4.9, abs=0.3)  # less the pressing force


def test_retraction_ends_where_something_holds_the_tool():
    bench = hit()
    for pull_N in (40.0, 40.0, 40.0, 0.0, 40.0, 40.0, 40.0):
        bench.tick(force_N=(0.0, 0.0, pull_N))
        assert bench.supervisor.retracting
    held = bench.tick(force_N=(0.0, 0.0, 40.0)).command
    assert not bench.supervisor.retracting
    assert held == bench.results[-2].command
    assert bench.tick().command == held


def test_arm_that_is_slower_than_the_retraction_gets_there_all_the_same():
    bench = hit()
    guard, ticks = bench.supervisor, 0
    while guard.retracting:
        before = bench.results[-2].command.position_rad if ticks == 0 else bench.here_rad
        requested = bench.results[-1].command.position_rad
        slow = tuple(b + 0.6 * (a - b) for a, b in zip(requested, before, strict=True))
        bench.applied = AppliedCommand(slow, CommandReason.VELOCITY_LIMIT)
        bench.results.append(guard.retreat(bench.snapshot()))
        ticks += 1
    assert 104 <= ticks < 115
    way = tips(bench, [bench.home_rad, bench.results[-1].command.position_rad])
    assert np.linalg.norm(way[1] - way[0]) == pytest.approx(15e-3, abs=2e-5)


def test_nobody_commands_an_arm_whose_place_is_not_known():
    bench = Bench()
    with pytest.raises(DeviceError, match="joint encoder: the first sample of the trial is stale"):
        bench.tick(joints={"validity": Validity.STALE})
    bench = Bench()
    with pytest.raises(DeviceError, match="gives 5 joint angles"):
        bench.tick(measured_rad=bench.home_rad[:5])


@pytest.mark.parametrize("turns", [1, -1])
def test_encoder_that_has_lost_a_turn_is_found_before_anything_is_commanded(turns):
    home, _ = ready_pose("ur5")
    off = (home[0], home[1] + turns * tau, *home[2:])
    bench = Bench(arm="ur5", ready_rad=home)
    with pytest.raises(DeviceError, match=r"joint encoder: joint 2 reads .* more than half a turn from the ready pose"):
        bench.tick(measured_rad=off)
    assert bench.results == []


def test_arm_that_stands_outside_is_held_at_its_limit():
    bench = Bench(HOLD)
    outside = (0.0, 1.702, -1.42, 0.0, 0.55, 0.0)
    done = bench.tick(measured_rad=outside, requested_rad=outside, tip_m=None, wrench={"validity": Validity.INVALID})
    assert done.command.position_rad == (0.0, 1.7, -1.42, 0.0, 0.55, 0.0)


# Commands beyond a joint limit are clamped, and both commands are kept.


REACH_RAD = 1.0 / 140


def with_first(q, value):
    return (value, *q[1:])


def test_command_that_is_too_fast_is_shortened():
    bench = Bench()
    bench.clean(2)
    requested = with_first(bench.home_rad, bench.home_rad[0] + 0.02)
    done = bench.tick(requested_rad=requested)
    assert done.command_override.reason is CommandReason.VELOCITY_LIMIT
    assert done.command_override.trip is None
    assert done.command_override.requested_rad == requested
    assert done.command_override.command_rad == done.command.position_rad
    assert done.command.position_rad == with_first(bench.home_rad, pytest.approx(bench.home_rad[0] + REACH_RAD))
    assert bench.applied == AppliedCommand(done.command.position_rad, CommandReason.VELOCITY_LIMIT)
    bench.clean(1, requested_rad=with_first(bench.home_rad, bench.home_rad[0] + 2 * REACH_RAD - 1e-9))


def test_arms_own_reason_goes_before_the_clamps():
    bench = Bench()
    bench.clean(2)
    done = bench.tick(requested_rad=with_first(bench.home_rad, bench.home_rad[0] + 0.02))
    stopped = AppliedCommand(bench.home_rad, CommandReason.STOPPED)
    assert done.command_override.applied(stopped) is stopped
