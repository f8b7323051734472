"""The loop over the ports: exact times, honest snapshots, and an arm that is stopped on every way out."""

from dataclasses import replace
from fractions import Fraction
from unittest.mock import Mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.contracts import FakeClock
from palpate.core.control_loop import (
    next_slot,
    next_snapshot,
    run_trial,
    tick_time_ns,
    trial_ticks,
)
from palpate.core.errors import DeviceError, LifecycleError
from palpate.core.ports import CONTROL_RATE_HZ, JointCommand, Ports, Validity, WrenchSample
from palpate.core.trial import Outcome
from tests.unit.core.fake_world import FakeWorld, FollowTorque, Pit, build_task
from tests.unit.core.supervision.bench import supervisor
from tests.unit.core.watched_task import HOLE, SETUP, Watch, assert_stopped, run


@given(start=st.integers(-(2**60), 2**60), tick=st.integers(0, 10**12))
def test_a_tick_is_never_a_nanosecond_off(start: int, tick: int) -> None:
    exact = start + Fraction(tick * 10**9, CONTROL_RATE_HZ)
    assert 0 <= exact - tick_time_ns(start, tick) < 1


def test_ticks_come_at_their_times_and_with_their_samples() -> None:
    world = FakeWorld(HOLE)
    world.clock.sleep_until(987_654_321)
    watch = Watch(world)
    with world:
        assert run(world, watch) is Outcome.INSERTED
        assert_stopped(world)
    assert [s.tick for s in watch.snapshots] == list(range(len(watch.snapshots)))
    for snapshot in watch.snapshots:
        assert snapshot.time_ns == tick_time_ns(987_654_321, snapshot.tick)
        assert snapshot.wrench.source_time_ns == snapshot.joints.source_time_ns == snapshot.time_ns
        assert snapshot.wrench.sequence == snapshot.joints.sequence == snapshot.tick


def test_a_snapshot_tells_what_became_of_the_command_before() -> None:
    world = FakeWorld(HOLE)
    watch = Watch(world)
    with world:
        run(world, watch)
    assert watch.snapshots[0].applied is None
    for command, later in zip(watch.commands, watch.snapshots[1:], strict=False):
        assert later.applied is not None
        assert later.applied.position_rad == command.position_rad
        # The arm is perfect: it stands where it was told to, one tick later and not sooner.
        assert later.joints.position_rad == command.position_rad


def test_slots_missed_are_left_out_and_the_schedule_keeps_its_phase() -> None:
    world = FakeWorld(HOLE)
    watch = Watch(world)

    def dawdle(tick: int) -> None:
        if tick == 10:
            world.clock.advance(4)

    watch.on_step = dawdle
    with world:
        assert run(world, watch) is Outcome.INSERTED
    times = [s.time_ns for s in watch.snapshots]
    assert times[:11] == [tick_time_ns(0, tick) for tick in range(11)]
    # The tick after the delay comes at once, in the slot that is running; no burst makes up for those that went by.
    assert tick_time_ns(0, 13) < times[11] <= tick_time_ns(0, 14)
    assert times[12:] == [tick_time_ns(0, tick + 2) for tick in range(12, len(times))]
    assert [s.tick for s in watch.snapshots] == list(range(len(times)))


@given(start=st.integers(0, 2**40), slot=st.integers(0, 10**6), late_ns=st.integers(0, 10**10))
def test_the_next_slot_is_the_first_that_has_not_begun(start: int, slot: int, late_ns: int) -> None:
    now = tick_time_ns(start, slot) + late_ns
    following = next_slot(start, slot, now)
    assert following > slot
    assert tick_time_ns(start, following) >= now
    assert following == slot + 1 or tick_time_ns(start, following - 1) <= now


class UnwellError(Exception):
    """Not of palpate's tree."""


@pytest.mark.parametrize("error", [UnwellError, KeyboardInterrupt, SystemExit, StopIteration])
@pytest.mark.parametrize("tick", [0, 1, 100])
def test_the_arm_is_stopped_when_the_task_fails(error: type[BaseException], tick: int) -> None:
    world = FakeWorld(HOLE)
    watch = Watch(world)

    def fail(now: int) -> None:
        if now == tick:
            raise error

    watch.on_step = fail
    with world:
        with pytest.raises(error):
            run(world, watch)
        assert_stopped(world)


def test_the_arm_is_stopped_when_a_trial_cannot_begin() -> None:
    arm, task = Mock(), Mock()
    task.begin.side_effect = UnwellError
    with pytest.raises(UnwellError):
        run_trial(task, Ports(FakeClock(), Mock(), Mock(), arm), SETUP)
    arm.stop.assert_called_once_with()


def test_ports_that_are_not_active_are_refused() -> None:
    world = FakeWorld(HOLE)
    with pytest.raises(LifecycleError):
        run(world, Watch(world))


def test_a_caller_who_steps_the_task_itself_has_the_same_trial() -> None:
    whole, halves = FakeWorld(HOLE), FakeWorld(HOLE)
    with whole:
        report = run_trial(build_task(FollowTorque()), whole.ports, SETUP)
    task, choices = build_task(FollowTorque()), 0
    with halves:
        ticks = trial_ticks(task, halves.ports, SETUP)
        snapshot = next(ticks, None)
        while snapshot is not None:
            observation = task.sense(snapshot)
            if observation is not None:
                # It is asked before it is chosen, and everything that the choice depends on is known.
                assert observation.action_number == choices == len(task.report.decisions)
                assert task.percept is not None
                assert observation.state == task.percept[1]
                assert (observation.force_N, observation.torque_Nm) == task.wrench_at_tip
                choices += 1
            snapshot = next_snapshot(ticks, task.act())
        assert_stopped(halves)
    assert task.report == report
    assert choices == report.actions > 1


def test_a_sensor_that_fails_while_the_tool_is_drawn_back_does_not_leave_it_there() -> None:
    drawn_back_to = []
    for fails in (False, True):
        world = FakeWorld(HOLE)
        read, last = world.ports.force_sensor.read, list[WrenchSample]()

        def read_on(read=read, last=last, fails=fails) -> WrenchSample:  # type: ignore[no-untyped-def]
            if fails and len(last) > 260:
                raise DeviceError("sensor", "is gone")
            last.append(read())
            return replace(last[-1], validity=Validity.STALE) if len(last) > 200 else last[-1]

        world.ports.force_sensor.read = read_on  # type: ignore[method-assign]
        with world:
            report = run_trial(build_task(FollowTorque()), world.ports, SETUP, supervisor())
            assert_stopped(world)
        assert report.events[-1].detail.startswith("SAMPLE_INVALID: the force sample is stale")
        drawn_back_to.append(world.arm.position_rad())
    assert drawn_back_to[0] == drawn_back_to[1]


@pytest.mark.parametrize("tripped", [False, True])
def test_what_a_trial_came_to_is_told_once_all_of_it_is_known(tripped: bool) -> None:
    world, policy = FakeWorld(Pit(0.3e-3, -0.2e-3)), FollowTorque()
    guard = supervisor()

    class Last(Watch):
        def act(self) -> JointCommand:
            assert policy.ended == []
            command = super().act()
            # The supervisor trips in the tick in which the task says that the peg is in.
            jump = 1.0 if tripped and self._task.done else 0.0
            return JointCommand(tuple(q + jump for q in command.position_rad))

    with world:
        report = run_trial(Last(world, policy), world.ports, SETUP, guard)  # type: ignore[arg-type]
        assert_stopped(world)
    (told,) = policy.ended
    assert (report.outcome, told.inserted) == ((Outcome.TRIPPED, False) if tripped else (Outcome.INSERTED, True))
    assert told.tip_m[:2] == pytest.approx((0.3e-3, -0.2e-3), abs=0.2e-3)
    assert told.depth_m == report.depth_m > 9e-3
