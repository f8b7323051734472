"""The loop over the ports: exact times, honest snapshots, observers, and an arm that is stopped on every way out."""

from dataclasses import replace
from fractions import Fraction
from functools import partialmethod
from itertools import pairwise
from unittest.mock import Mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.contracts import FakeClock
from palpate.core.control_loop import LoopObserver, next_slot, run_trial, tick_time_ns
from palpate.core.errors import DeviceError, LifecycleError
from palpate.core.ports import CONTROL_RATE_HZ, JointCommand, Life, Ports, Validity, WrenchSample
from palpate.core.trial import Outcome
from tests.unit.core.fake_world import FakeWorld, FollowTorque, Pit, build_task
from tests.unit.core.supervision.bench import supervisor
from tests.unit.core.watched_task import HOLE, SETUP, Watch, assert_stopped, run


class UnwellError(Exception):
    """Not of palpate's tree."""


class TestLoop:
    @given(start=st.integers(-(2**60), 2**60), tick=st.integers(0, 10**12))
    def test_tick_is_never_a_nanosecond_off(self, start, tick):
        exact = start + Fraction(tick * 10**9, CONTROL_RATE_HZ)
        assert 0 <= exact - tick_time_ns(start, tick) < 1

    def test_ticks_come_at_their_times_and_with_their_samples(self):
        world = FakeWorld(HOLE)
        world.clock.sleep_until(987_654_321)
        monitor = Watch(world)
        with world:
            assert run(world, monitor) is Outcome.INSERTED
            assert_stopped(world)
        assert [s.tick for s in monitor.snapshots] == list(range(len(monitor.snapshots)))
        for snapshot in monitor.snapshots:
            assert snapshot.time_ns == tick_time_ns(987_654_321, snapshot.tick)
            assert snapshot.wrench.source_time_ns == snapshot.joints.source_time_ns == snapshot.time_ns
            assert snapshot.wrench.sequence == snapshot.joints.sequence == snapshot.tick

    def test_slots_missed_are_left_out_and_the_schedule_keeps_its_phase(self):
        world = FakeWorld(HOLE)
        monitor = Watch(world)

        def dawdle(tick):
            if tick == 10:
                world.clock.advance(4)

        monitor.on_step = dawdle
        with world:
            assert run(world, monitor) is Outcome.INSERTED
        times = [s.time_ns for s in monitor.snapshots]
        assert times[:11] == [tick_time_ns(0, tick) for tick in range(11)]
        # The tick after the delay comes at once, in the slot that is running; no burst makes up for those that went by.
        assert tick_time_ns(0, 13) < times[11] <= tick_time_ns(0, 14)
        assert times[12:] == [tick_time_ns(0, tick + 2) for tick in range(12, len(times))]
        assert [s.tick for s in monitor.snapshots] == list(range(len(times)))

    @given(start=st.integers(0, 2**40), slot=st.integers(0, 10**6), late_ns=st.integers(0, 10**10))
    def test_next_slot_is_the_first_that_has_not_begun(self, start, slot, late_ns):
        now = tick_time_ns(start, slot) + late_ns
        following = next_slot(start, slot, now)
        assert following > slot
        assert tick_time_ns(start, following) >= now
        assert following == slot + 1 or tick_time_ns(start, following - 1) <= now

    @pytest.mark.parametrize("error", [UnwellError, KeyboardInterrupt, SystemExit, StopIteration])
    @pytest.mark.parametrize("tick", [0, 1, 100])
    def test_arm_is_stopped_when_the_task_fails(self, error, tick):
        world = FakeWorld(HOLE)
        monitor = Watch(world)

        def fail(now):
            if now == tick:
                raise error

        monitor.on_step = fail
        with world:
            with pytest.raises(error):
                run(world, monitor)
            assert_stopped(world)

    def test_arm_is_stopped_when_a_trial_cannot_begin(self):
        arm, task = Mock(), Mock()
        task.begin.side_effect = UnwellError
        with pytest.raises(UnwellError):
            run_trial(task, Ports(FakeClock(), Mock(), Mock(), arm), SETUP)
        arm.stop.assert_called_once_with()

    def test_ports_that_are_not_active_are_refused(self):
        world = FakeWorld(HOLE)
        with pytest.raises(LifecycleError):
            run(world, Watch(world))

    def test_sensor_that_fails_while_the_tool_is_drawn_back_does_not_leave_it_there(self):
        drawn_back_to = []
        for fails in (False, True):
            world = FakeWorld(HOLE)
            read, last = world.ports.force_sensor.read, list[WrenchSample]()

            def read_on(read=read, last=last, fails=fails):
                if fails and len(last) > 260:
                    raise DeviceError("sensor", "is gone")
                last.append(read())
                return replace(last[-1], validity=Validity.STALE) if len(last) > 200 else last[-1]

            world.ports.force_sensor.read = read_on
            with world:
                report = run_trial(build_task(FollowTorque()), world.ports, SETUP, supervisor())
                assert_stopped(world)
            assert report.events[-1].detail.startswith("SAMPLE_INVALID: the force sample is stale")
            drawn_back_to.append(world.arm.position_rad())
        assert drawn_back_to[0] == drawn_back_to[1]

    @pytest.mark.parametrize("tripped", [False, True])
    def test_result_of_a_trial_is_notified_once_all_of_it_is_known(self, tripped):
        world, policy = FakeWorld(Pit(0.3e-3, -0.2e-3)), FollowTorque()
        guard = supervisor()

        class Last(Watch):
            def act(self):
                assert policy.ended == []
                command = super().act()
                # The supervisor trips in the tick in which the task says that the peg is in.
                jump = 1.0 if tripped and self._task.done else 0.0
                return JointCommand(tuple(q + jump for q in command.position_rad))

        with world:
            report = run_trial(Last(world, policy), world.ports, SETUP, guard)
            assert_stopped(world)
        (message,) = policy.ended
        assert (report.outcome, message.inserted) == ((Outcome.TRIPPED, False) if tripped else (Outcome.INSERTED, True))
        assert message.tip_m[:2] == pytest.approx((0.3e-3, -0.2e-3), abs=0.2e-3)
        assert message.depth_m == report.depth_m > 9e-3


class Diary(LoopObserver):
    """Keeps the names of all events but ``ended``, and what some of them brought."""

    def __init__(self, world):
        self.events = []
        self.ticks = []
        self.sends = []
        self.failures = []
        self.stops = []
        self._world = world

    def begun(self, start_ns, report):
        self.events.append("begun")
        self.report = report

    def waited(self, tick, deadline_ns):
        self.events.append("waited")
        self.ticks.append((tick, deadline_ns))

    def _note(self, event, *_):
        self.events.append(event)

    clock_read = partialmethod(_note, "clock_read")
    force_read = partialmethod(_note, "force_read")
    joints_read = partialmethod(_note, "joints_read")
    sensed = partialmethod(_note, "sensed")
    chosen = partialmethod(_note, "chosen")
    acted = partialmethod(_note, "acted")

    def supervised(self, supervised):
        self.events.append("supervised")
        assert supervised.command is not None

    def sent(self, snapshot, command, applied):
        self.events.append("sent")
        self.sends.append((command, applied))

    def failed(self, error, tick):
        self.events.append("failed")
        self.failures.append((error, tick))
        assert_stopped(self._world)

    def stopped(self, error):
        self.events.append("stopped")
        self.stops.append(error)
        assert_stopped(self._world)


PLAIN_TICK = ["waited", "clock_read", "force_read", "joints_read", "sensed", "acted", "sent"]


def split(events):
    """Tick by tick."""
    starts = [at for at, name in enumerate(events) if name == "waited"]
    return [events[a:b] for a, b in pairwise([*starts, len(events)])]


class TestObservers:
    def test_observers_are_called_in_order_and_change_nothing(self):
        world, alone = FakeWorld(HOLE), FakeWorld(HOLE)
        diary, again = Diary(world), Diary(world)
        task = build_task(FollowTorque())
        with world, alone:
            report = run_trial(task, world.ports, SETUP, None, (diary, LoopObserver(), again))
            assert report == run_trial(build_task(FollowTorque()), alone.ports, SETUP)
        assert diary.report is report
        assert diary.events == again.events
        assert diary.events[0] == "begun"
        assert diary.events.pop() == "stopped"
        assert diary.stops == [None]
        ticks = split(diary.events)
        choosing = [*PLAIN_TICK[:5], "chosen", *PLAIN_TICK[5:]]
        assert [tick for tick in ticks if tick != PLAIN_TICK] == [choosing] * report.actions
        assert len(ticks) == report.ticks == len(diary.sends)
        assert diary.ticks == [(tick, tick_time_ns(0, tick)) for tick in range(report.ticks)]

    @pytest.mark.parametrize(("device", "calling"), [("sensor", "force_sensor"), ("encoder", "joint_encoder")])
    def test_failure_is_observed_with_the_tick_as_far_as_it_came(self, device, calling):
        world = FakeWorld(HOLE)
        diary, monitor = Diary(world), Watch(world)
        monitor.on_step = lambda tick: setattr(getattr(world, device), "disconnected", tick == 50)
        with world, pytest.raises(DeviceError, match="does not answer") as caught:
            run_trial(monitor, world.ports, SETUP, None, (diary,))
        ((error, tick),) = diary.failures
        assert error is caught.value
        assert (tick.calling, tick.time_ns) == (calling, tick_time_ns(0, 51))
        assert (tick.wrench is None, tick.joints, tick.command) == (device == "sensor", None, None)
        assert diary.events[-2:] == ["failed", "stopped"]

    def test_arm_is_stopped_when_it_refuses_a_command_and_that_is_observed(self):
        world = FakeWorld(HOLE)
        policy = FollowTorque()
        diary, monitor = Diary(world), Watch(world, policy)
        monitor.on_step = lambda tick: world.arm.fail("follow-up error") if tick == 30 else None
        with world:
            with pytest.raises(DeviceError, match="follow-up error"):
                run_trial(monitor, world.ports, SETUP, None, (diary,))
            assert world.arm.life is Life.FAULTED
            here = world.arm.position_rad()
            world.clock.advance(10)
            assert world.arm.position_rad() == here
        ((_, tick),) = diary.failures
        assert (tick.calling, tick.command) == ("arm", monitor.commands[-1])
        assert tick.wrench is not None
        # A trial that an error ended came to nothing.
        assert policy.ended == []

    def test_arm_that_cannot_be_stopped_is_observed_too(self, monkeypatch):
        world, error = FakeWorld(HOLE), DeviceError("arm", "cable cut")
        diary = Diary(world)

        def fail():
            raise error

        monkeypatch.setattr(Diary, "stopped", lambda self, error: self.stops.append(error))
        with world:
            with monkeypatch.context() as cut:
                cut.setattr(world.arm, "stop", fail)
                with pytest.raises(DeviceError, match="cable cut"):
                    run_trial(build_task(FollowTorque()), world.ports, SETUP, None, (diary,))
        assert diary.stops == [error]
        assert diary.failures == []
