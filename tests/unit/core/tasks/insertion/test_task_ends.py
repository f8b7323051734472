"""Every way in which a trial of the insertion task ends before the peg is in its hole."""

from dataclasses import replace
from itertools import count
from math import nan

import pytest

from palpate.core.control_loop import run_trial
from palpate.core.errors import DeviceError
from palpate.core.ports.values import Validity
from palpate.core.trial import Outcome, TaskConfig, TrialSetup
from tests.unit.core.fake_world import FakeWorld, FollowTorque, Pit, Steps, build_task
from tests.unit.core.supervision.bench import supervisor
from tests.unit.core.tasks.insertion.whole_trial import FAR_AWAY, HOLE, START, Trial, plus


@pytest.fixture(scope="module")
def good():
    """A trial as it should be."""
    return Trial(FakeWorld(HOLE))


def test_the_time_limit_ends_the_exploration():
    trial = Trial(FakeWorld(FAR_AWAY), config=TaskConfig(time_limit_s=1.5))
    assert trial.report.outcome is Outcome.TIME_LIMIT
    assert trial.report.exploration_time_s == pytest.approx(1.5)
    assert trial.report.actions == len(trial.report.decisions) == 14
    assert trial.events("end")[0].detail == "time limit: 1.5 s"
    # The last action cost like any other, and it is not the goal.
    assert [t.next_state for t in trial.policy.learned].count(None) == 0
    assert len(trial.policy.learned) == 14
    assert trial.report.decisions[-1].reinforcement == -1.0
    assert trial.report.depth_m == pytest.approx(0.0, abs=2e-5)
    assert trial.stopped


@pytest.mark.parametrize(("depth_mm", "slack_mm", "inserted"), [(9.4, 0.5, True), (9.4, 0.3, False), (9.85, 0.0, True)])
def test_without_a_touch_the_surface_is_known_only_roughly(depth_mm, slack_mm, inserted):
    hole = Pit(*START, depth_m=depth_mm * 1e-3)
    config = TaskConfig(surface_uncertainty_mm=slack_mm, time_limit_s=0.5)
    trial = Trial(FakeWorld(hole), Steps(), config=config)
    assert (trial.report.outcome is Outcome.INSERTED) is inserted


def test_the_force_limit_ends_the_trial_in_the_same_tick():
    world = FakeWorld(HOLE)
    reads = iter(range(10_000))
    world.spoil = lambda sample: (
        replace(sample, force_N=plus(sample.force_N, (0.0, 0.0, -31.0))) if next(reads) == 100 else sample
    )
    trial = Trial(world)
    assert trial.report.outcome is Outcome.FORCE_LIMIT
    assert trial.report.ticks == 101
    assert trial.report.peak_force_N == pytest.approx(31.0)
    assert trial.events("end")[0].detail == "force limit: 31.00 N, limit 30 N"
    assert trial.stopped


def test_a_force_that_ends_the_trial_latches_with_a_supervisor_as_it_comes():
    """A sensor that shows ten times the force ended a trial at a true 8 N, and the next one began."""
    guard, world, task = supervisor(), FakeWorld(HOLE), build_task(FollowTorque())
    reads = count()
    # No faster than a force may rise.
    world.spoil = lambda sample: replace(
        sample, force_N=plus(sample.force_N, (0.0, 0.0, -15.5 * max(next(reads) - 99, 0)))
    )
    with world:
        report = run_trial(task, world.ports, TrialSetup(0, 1, START), guard)
    assert report.outcome is Outcome.FORCE_LIMIT
    assert guard.trip is not None
    assert guard.trip.text == "force 31.00 N, limit 30 N"
    assert guard.latch.cause == f"FORCE_LIMIT: {guard.trip.text}"


BAD_WRENCHES = {
    "stale": lambda w: replace(w, validity=Validity.STALE),
    "saturated": lambda w: replace(w, validity=Validity.SATURATED),
    "invalid": lambda w: replace(w, force_N=(nan, 0.0, 0.0), validity=Validity.INVALID),
}
BAD_JOINTS = {
    "stale": lambda j: replace(j, validity=Validity.STALE),
    "invalid": lambda j: replace(j, position_rad=(nan,) * 6, validity=Validity.INVALID),
}


def spoiled(snapshot, device, kind):
    if device == "force":
        return snapshot._replace(wrench=BAD_WRENCHES[kind](snapshot.wrench))
    return snapshot._replace(joints=BAD_JOINTS[kind](snapshot.joints))


@pytest.mark.parametrize(
    ("device", "kind"), [*(("force", kind) for kind in BAD_WRENCHES), *(("joint", kind) for kind in BAD_JOINTS)]
)
@pytest.mark.parametrize("when", [0, 90])
def test_a_bad_sample_ends_the_trial(device, kind, when, good):
    world = FakeWorld(HOLE)

    def spoil(tick, snapshot):
        return spoiled(snapshot, device, kind) if tick == when else snapshot

    if device == "joint" and when == 0:
        with pytest.raises(DeviceError, match=f"the first sample of the trial is {kind}"):
            Trial(world, on_step=spoil)
        return
    trial = Trial(world, on_step=spoil)
    assert trial.report.outcome is Outcome.SENSOR_FAULT
    assert trial.report.ticks == when + 1
    found = {"force": "valid", "joint": "valid", device: kind}
    assert (
        trial.events("end")[0].detail == f"sensor fault: force sample {found['force']}, joint sample {found['joint']}"
    )
    assert trial.commands[:-1] == good.commands[:when]
    if when:
        # The last command holds still where the one before led.
        assert trial.commands[-1].position_rad == pytest.approx(trial.commands[-2].position_rad, abs=1e-6)
    assert all(t.next_state is not None for t in trial.policy.learned)
    assert trial.stopped


def test_a_fault_at_once_reports_nothing_of_the_trial_before():
    policy = FollowTorque()
    task = build_task(policy)
    assert Trial(FakeWorld(HOLE), policy, task=task).report.depth_m > 9e-3
    trial = Trial(
        FakeWorld(HOLE),
        policy,
        task=task,
        on_step=lambda tick, s: spoiled(s, "force", "stale"),
    )
    assert trial.report.outcome is Outcome.SENSOR_FAULT
    assert trial.report.depth_m == 0.0
    assert trial.report.peak_force_N == 0.0
    assert trial.report.decisions == []


def interrupted(when):
    policy = FollowTorque()
    task = build_task(policy)

    def interrupt(tick, snapshot):
        if tick == when:
            task.interrupt()
        return snapshot

    return Trial(FakeWorld(HOLE), policy, task=task, on_step=interrupt)


@pytest.mark.parametrize("when", [119, 130, 131, 132, 133, 146])
def test_an_interrupt_lets_the_running_action_end(when, good):
    (contact,) = good.events("contact")
    assert contact.tick == 118
    trial = interrupted(when)
    assert trial.report.outcome is Outcome.INTERRUPTED
    last = trial.report.ticks - 1
    assert when <= last < when + 14
    assert (last - contact.tick) % 14 == 0
    assert len(trial.report.decisions) == (last - contact.tick) // 14 - 1  # no further choice was made
    assert trial.commands[:-1] == good.commands[:last]


def test_a_trial_ends_for_one_reason_only():
    task = build_task(FollowTorque())

    def interrupt_and_hit(tick, s):
        if tick < 100:
            return s
        task.interrupt()
        return s._replace(wrench=replace(s.wrench, force_N=plus(s.wrench.force_N, (0.0, 0.0, -31.0))))

    trial = Trial(FakeWorld(HOLE), task=task, on_step=interrupt_and_hit)
    assert trial.report.outcome is Outcome.INTERRUPTED
    assert len(trial.events("end")) == 1
