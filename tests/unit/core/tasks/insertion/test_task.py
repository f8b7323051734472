"""The insertion task over bare ports: a trial as it should be, and every way in which one ends early."""

from dataclasses import replace
from itertools import count
from math import hypot

import numpy as np
import pytest

from palpate.core.control_loop import run_trial
from palpate.core.errors import ConfigurationError, DeviceError
from palpate.core.policy import DONE, Decision
from palpate.core.ports import PERIOD_S
from palpate.core.ports.values import Validity
from palpate.core.tasks.insertion.phases.equipment import Controllers
from palpate.core.trial import ControlConfig, Outcome, Phase, TaskConfig, TrialSetup
from tests.unit.core.fake_world import (
    WEIGHT_AND_BIAS_N,
    WEIGHT_AND_BIAS_NM,
    FakeWorld,
    FollowTorque,
    Pit,
    Steps,
    build_task,
)
from tests.unit.core.supervision.bench import supervisor
from tests.unit.core.tasks.insertion.whole_trial import EAST, FAR_AWAY, HOLE, START, Trial, plus


@pytest.fixture(scope="module")
def good():
    """A trial as it should be."""
    return Trial(FakeWorld(HOLE))


@pytest.mark.parametrize(("spring", "gain"), [("axial", "damping_N_s_per_m"), ("lateral", "force_integral_m_per_N_s")])
def test_gain_that_is_too_high_for_a_stiff_gripper_is_refused(spring, gain):
    stiff = {f"{spring}_stiffness_N_per_mm": 1000.0}
    with pytest.raises(ConfigurationError, match=gain):
        Controllers.of(TaskConfig(), ControlConfig(**stiff))


def test_trial_goes_through_its_phases_in_order(good):
    assert good.report.outcome is Outcome.INSERTED
    entered = [event.detail for event in good.events("phase")]
    assert entered == ["transfer", "settle", "approach", "explore", "insert"]
    order = list(Phase)
    positions = [order.index(phase) for phase in good.phases]
    assert positions == sorted(positions)
    assert good.phases[-1] is Phase.DONE
    assert Phase.DONE not in good.phases[:-1]
    assert good.events("end")[0].detail == "inserted: depth 10.000 mm"
    assert good.report.events[-1].name == "end"
    assert good.report.ticks == len(good.snapshots)
    assert good.stopped


def test_sensor_is_tared_once_at_rest_and_says_so(good):
    (tare,) = good.events("tare")
    (settle,) = [event for event in good.events("phase") if event.detail == "settle"]
    assert tare.tick - settle.tick == 56  # as many ticks of rest as of averaging
    numbers = [float(word) for word in tare.detail.replace(",", "").split() if word[-1].isdigit()]
    assert numbers == pytest.approx([*WEIGHT_AND_BIAS_N, *WEIGHT_AND_BIAS_NM], rel=1e-5)
    rest = good.snapshots[settle.tick + 1 : tare.tick + 1]
    still = np.ptp([snapshot.joints.position_rad for snapshot in rest], axis=0)
    assert still.max() < 1e-5
    assert all(good.forces[tick][2] == 0.0 for tick in range(tare.tick + 1))  # in free air


def test_torque_leads_to_the_hole(good):
    (contact,), (lost,) = good.events("contact"), good.events("contact lost")
    assert good.report.exploration_time_s == pytest.approx((lost.tick - contact.tick) * PERIOD_S)
    distance = hypot(START[0] - HOLE.x_m, START[1] - HOLE.y_m)
    assert good.report.actions == len(good.report.decisions)
    assert 0.5e-3 * good.report.actions < distance + 0.5e-3
    assert good.events("hole")[0].detail == f"found after {good.report.exploration_time_s:.3f} s"
    assert {record.state for record in good.report.decisions[1:]} == {"tx0 ty+"}


def test_trial_does_not_depend_on_the_one_before(good):
    policy = FollowTorque()
    task = build_task(policy)
    Trial(FakeWorld(Pit(0.0, 0.0, depth_m=5e-3)), policy, (0.5e-3, 0.0), task=task)
    second = Trial(FakeWorld(HOLE), policy, task=task)
    assert second.commands == good.commands
    assert second.report == good.report


@pytest.mark.parametrize("height_m", [-1.5e-3, -0.5e-3, 0.5e-3, 1.2e-3])
def test_depth_counts_from_the_surface_that_was_touched(height_m):
    trial = Trial(FakeWorld(HOLE, height_m=height_m))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.report.depth_m == pytest.approx(0.010, abs=5e-5)
    assert f"surface at {height_m * 1e3:.3f} mm" in trial.events("contact")[0].detail


def test_samples_while_the_arm_comes_to_rest_are_not_tared_in():
    world = FakeWorld(HOLE)
    reads = iter(range(10_000))

    def ring(sample):
        # Until 26 ticks after the arm has arrived, as in the good trial.
        return replace(sample, force_N=plus(sample.force_N, (3.0, 2.0, 1.0))) if next(reads) <= 16 + 26 else sample

    world.spoil = ring
    trial = Trial(world)
    assert trial.events("phase")[1].tick == 16
    numbers = [float(word) for word in trial.events("tare")[0].detail.split()[:3]]
    assert numbers == pytest.approx(WEIGHT_AND_BIAS_N, rel=1e-5)


def test_tilted_plate_is_not_taken_for_a_hole():
    world = FakeWorld(FAR_AWAY)
    world.slope = 0.05
    policy = Steps(displacements_m=[EAST] * 14)
    trial = Trial(world, policy, (-3e-3, 0.0), TaskConfig(time_limit_s=2.0))
    assert trial.report.outcome is Outcome.TIME_LIMIT
    assert trial.tips[-1][0] > 3.4e-3  # more than 0.3 mm lower than where it began, as deep as a drop
    assert Phase.INSERT not in trial.phases


def test_peg_that_sinks_against_friction_has_found_the_hole():
    # The wall goes on pushing back with more than the contact threshold.
    trial = Trial(FakeWorld(replace(HOLE, friction_N=2.0)))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.events("contact lost") == []
    assert len(trial.events("sunk below the surface")) == 1
    assert trial.report.depth_m == pytest.approx(0.010, abs=2.5e-4)  # contact and depth: the tolerance is enough


def test_peg_stays_inside_the_exploration_area():
    policy = Steps(displacements_m=[EAST] * 12 + [(0.0, -0.5e-3)] * 12)
    trial = Trial(FakeWorld(FAR_AWAY), policy, (0.0, 0.0), TaskConfig(time_limit_s=3.0))
    tips = np.array([trial.tips[tick] for tick in trial.in_phase(Phase.EXPLORE)])
    assert tips[:, 0].max() == pytest.approx(3.5e-3, abs=1e-6)
    assert tips[:, 1].min() == pytest.approx(-3.5e-3, abs=1e-6)


def test_time_limit_ends_the_exploration():
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


def test_force_that_ends_the_trial_latches_with_a_supervisor_as_it_comes():
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
    assert guard.trip.text == "force 31.00 N, limit 30 N"
    assert guard.latch.cause == f"FORCE_LIMIT: {guard.trip.text}"


def spoiled(snapshot, device, kind):
    validity = Validity(kind)
    if device == "force":
        return snapshot._replace(wrench=replace(snapshot.wrench, validity=validity))
    return snapshot._replace(joints=replace(snapshot.joints, validity=validity))


@pytest.mark.parametrize(
    ("device", "kind"),
    [("force", "stale"), ("force", "saturated"), ("force", "invalid"), ("joint", "stale"), ("joint", "invalid")],
)
@pytest.mark.parametrize("when", [0, 90])
def test_bad_sample_ends_the_trial(device, kind, when, good):
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


def interrupted(when):
    policy = FollowTorque()
    task = build_task(policy)

    def interrupt(tick, snapshot):
        if tick == when:
            task.interrupt()
        return snapshot

    return Trial(FakeWorld(HOLE), policy, task=task, on_step=interrupt)


class Claims(FollowTorque):
    """States after some steps that the peg is in."""

    def choose(self, observation):
        assert (observation.press_N, observation.limit_N) == (pytest.approx(4.903325), 30.0)
        return Decision(DONE, None, "claims") if observation.action_number == 3 else super().choose(observation)


def test_policy_that_lies_about_the_end_is_not_believed():
    trial = Trial(FakeWorld(FAR_AWAY), Claims())
    assert trial.events("done")[0].detail == "by the policy, to be verified"
    assert trial.report.outcome is Outcome.WEDGED
    assert len(trial.report.decisions) == 4
    assert trial.report.depth_m < 1e-4


@pytest.mark.parametrize(("springs", "outcome"), [(False, Outcome.INSERTED), (True, Outcome.UNCERTAIN_DEPTH)])
def test_success_is_confirmed_without_the_press(springs, outcome):
    world, policy = FakeWorld(HOLE), FollowTorque()
    task = build_task(policy, TaskConfig(release_s=0.4))

    def spring_back(tick, snapshot):
        if springs and any(event.detail.startswith("depth") for event in task.report.events):
            world.pits = (replace(HOLE, depth_m=HOLE.depth_m - 0.5e-3),)
            world._inside = world.pits[0]
        return snapshot

    trial = Trial(world, policy, task=task, on_step=spring_back)
    assert trial.report.outcome is outcome
    assert abs(trial.forces[-1][2]) < 0.2


@pytest.mark.parametrize("when", [119, 130, 131, 132, 133, 146])
def test_interrupt_lets_the_running_action_end(when, good):
    (contact,) = good.events("contact")
    assert contact.tick == 118
    trial = interrupted(when)
    assert trial.report.outcome is Outcome.INTERRUPTED
    last = trial.report.ticks - 1
    assert when <= last < when + 14
    assert (last - contact.tick) % 14 == 0
    assert len(trial.report.decisions) == (last - contact.tick) // 14 - 1  # no further choice was made
    assert trial.commands[:-1] == good.commands[:last]
