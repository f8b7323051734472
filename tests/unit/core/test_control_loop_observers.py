"""Who watches the loop is called in order, on every way out, and changes nothing."""

from functools import partialmethod
from itertools import pairwise

import pytest

from palpate.core.control_loop import (
    LoopObserver,
    UnfinishedTick,
    run_trial,
    tick_time_ns,
    trial_ticks,
)
from palpate.core.errors import DeviceError
from palpate.core.ports import AppliedCommand, JointCommand, Life, Snapshot
from palpate.core.trial import Outcome, Supervised, TrialReport
from tests.unit.core.fake_world import FakeWorld, FollowTorque, build_task
from tests.unit.core.supervision.bench import supervisor
from tests.unit.core.watched_task import HOLE, SETUP, Watch, assert_stopped


class Diary(LoopObserver):
    """Keeps the names of all events but ``ended``, and what some of them brought."""

    def __init__(self, world: FakeWorld) -> None:
        self.events: list[str] = []
        self.ticks: list[tuple[int, int]] = []
        self.sends: list[tuple[JointCommand, AppliedCommand]] = []
        self.failures: list[tuple[BaseException, UnfinishedTick]] = []
        self.stops: list[BaseException | None] = []
        self._world = world

    def begun(self, start_ns: int, report: TrialReport) -> None:
        self.events.append("begun")
        self.report = report

    def waited(self, tick: int, deadline_ns: int) -> None:
        self.events.append("waited")
        self.ticks.append((tick, deadline_ns))

    def _note(self, event: str, *_: object) -> None:
        self.events.append(event)

    clock_read = partialmethod(_note, "clock_read")
    force_read = partialmethod(_note, "force_read")
    joints_read = partialmethod(_note, "joints_read")
    sensed = partialmethod(_note, "sensed")
    chosen = partialmethod(_note, "chosen")
    acted = partialmethod(_note, "acted")

    def supervised(self, supervised: Supervised) -> None:
        self.events.append("supervised")
        assert supervised.command is not None

    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        self.events.append("sent")
        self.sends.append((command, applied))

    def failed(self, error: BaseException, tick: UnfinishedTick) -> None:
        self.events.append("failed")
        self.failures.append((error, tick))
        assert_stopped(self._world)

    def stopped(self, error: BaseException | None) -> None:
        self.events.append("stopped")
        self.stops.append(error)
        assert_stopped(self._world)


PLAIN_TICK = ["waited", "clock_read", "force_read", "joints_read", "sensed", "acted", "sent"]


def split(events: list[str]) -> list[list[str]]:
    """Tick by tick."""
    starts = [at for at, name in enumerate(events) if name == "waited"]
    return [events[a:b] for a, b in pairwise([*starts, len(events)])]


def test_observers_are_called_in_order_and_change_nothing() -> None:
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


def test_a_retreat_is_observed_without_anything_asked() -> None:
    world = FakeWorld(HOLE)
    diary, guard = Diary(world), supervisor()

    class Jumpy(Watch):
        def act(self) -> JointCommand:
            command = super().act()
            return command if len(self.commands) < 50 else JointCommand(tuple(q + 1.0 for q in command.position_rad))

    with world:
        report = run_trial(Jumpy(world), world.ports, SETUP, guard, (diary,))  # type: ignore[arg-type]
    assert report.outcome is Outcome.TRIPPED
    assert diary.events.pop() == "stopped"
    ticks = split(diary.events)
    watched = [*PLAIN_TICK[:6], "supervised", "sent"]
    retreat = [name for name in watched if name not in ("sensed", "acted")]
    assert ticks == [watched] * report.ticks + [retreat] * (len(ticks) - report.ticks)
    assert len(ticks) > report.ticks


@pytest.mark.parametrize(("device", "calling"), [("sensor", "force_sensor"), ("encoder", "joint_encoder")])
def test_what_failed_is_observed_with_the_tick_as_far_as_it_came(device: str, calling: str) -> None:
    world = FakeWorld(HOLE)
    diary, watch = Diary(world), Watch(world)
    watch.on_step = lambda tick: setattr(getattr(world, device), "disconnected", tick == 50)
    with world, pytest.raises(DeviceError, match="does not answer") as caught:
        run_trial(watch, world.ports, SETUP, None, (diary,))  # type: ignore[arg-type]
    ((error, tick),) = diary.failures
    assert error is caught.value
    assert (tick.calling, tick.time_ns) == (calling, tick_time_ns(0, 51))
    assert (tick.wrench is None, tick.joints, tick.command) == (device == "sensor", None, None)
    assert diary.events[-2:] == ["failed", "stopped"]


def test_the_arm_is_stopped_when_it_refuses_a_command_and_that_is_observed() -> None:
    world = FakeWorld(HOLE)
    policy = FollowTorque()
    diary, watch = Diary(world), Watch(world, policy)
    watch.on_step = lambda tick: world.arm.fail("follow-up error") if tick == 30 else None
    with world:
        with pytest.raises(DeviceError, match="follow-up error"):
            run_trial(watch, world.ports, SETUP, None, (diary,))  # type: ignore[arg-type]
        assert world.arm.life is Life.FAULTED
        here = world.arm.position_rad()
        world.clock.advance(10)
        assert world.arm.position_rad() == here
    ((_, tick),) = diary.failures
    assert (tick.calling, tick.command) == ("arm", watch.commands[-1])
    assert tick.wrench is not None
    # A trial that an error ended came to nothing.
    assert policy.ended == []


def test_an_observer_that_raises_ends_the_trial_and_is_no_port() -> None:
    world = FakeWorld(HOLE)
    diary = Diary(world)

    class Strict(LoopObserver):
        def clock_read(self, deadline_ns: int, time_ns: int) -> None:
            raise DeviceError("control loop", "late")

    with world, pytest.raises(DeviceError, match="late"):
        run_trial(build_task(FollowTorque()), world.ports, SETUP, None, (diary, Strict()))
    ((_, tick),) = diary.failures
    assert (tick.calling, tick.wrench) == ("", None)
    assert diary.events == ["begun", "waited", "clock_read", "failed", "stopped"]


def test_an_arm_that_cannot_be_stopped_is_observed_too(monkeypatch: pytest.MonkeyPatch) -> None:
    world, error = FakeWorld(HOLE), DeviceError("arm", "cable cut")
    diary = Diary(world)

    def fail() -> None:
        raise error

    monkeypatch.setattr(Diary, "stopped", lambda self, error: self.stops.append(error))
    with world:
        with monkeypatch.context() as cut:
            cut.setattr(world.arm, "stop", fail)
            with pytest.raises(DeviceError, match="cable cut"):
                run_trial(build_task(FollowTorque()), world.ports, SETUP, None, (diary,))
    assert diary.stops == [error]
    assert diary.failures == []


def test_ticks_that_are_let_go_are_observed() -> None:
    world = FakeWorld(HOLE)
    diary, task = Diary(world), build_task(FollowTorque())
    with world:
        ticks = trial_ticks(task, world.ports, SETUP, None, (diary,))
        task.sense(next(ticks))
        ticks.close()
    ((error, tick),) = diary.failures
    assert isinstance(error, GeneratorExit)
    assert (tick.wrench is None, tick.joints is None, tick.calling) == (False, False, "")
    assert diary.events == ["begun", *PLAIN_TICK[:4], "failed", "stopped"]
