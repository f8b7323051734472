"""The insertion task over bare ports: a trial as it should be, and what does not depend on the trial."""

from dataclasses import replace
from math import hypot

import numpy as np
import pytest

from palpate.core.errors import PolicyError
from palpate.core.ports import PERIOD_S
from palpate.core.trial import Outcome, Phase, Purpose, TaskConfig, TrialSetup, generator
from tests.unit.core.fake_world import (
    WEIGHT_AND_BIAS_N,
    WEIGHT_AND_BIAS_NM,
    FakeWorld,
    FollowTorque,
    Pit,
    Steps,
    build_task,
)
from tests.unit.core.tasks.insertion.whole_trial import EAST, FAR_AWAY, HOLE, PRESS_N, START, Trial, plus


@pytest.fixture(scope="module")
def good():
    """A trial as it should be."""
    return Trial(FakeWorld(HOLE))


def test_a_trial_goes_through_its_phases_in_order(good):
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


def test_the_sensor_is_tared_once_at_rest_and_says_so(good):
    (tare,) = good.events("tare")
    (settle,) = [event for event in good.events("phase") if event.detail == "settle"]
    assert tare.tick - settle.tick == 56  # as many ticks of rest as of averaging
    numbers = [float(word) for word in tare.detail.replace(",", "").split() if word[-1].isdigit()]
    assert numbers == pytest.approx([*WEIGHT_AND_BIAS_N, *WEIGHT_AND_BIAS_NM], rel=1e-5)
    rest = good.snapshots[settle.tick + 1 : tare.tick + 1]
    still = np.ptp([snapshot.joints.position_rad for snapshot in rest], axis=0)
    assert still.max() < 1e-5
    assert all(good.forces[tick][2] == 0.0 for tick in range(tare.tick + 1))  # in free air


def test_exploration_presses_steadily_and_acts_ten_times_a_second(good):
    ticks = [record.tick for record in good.report.decisions]
    (contact,) = good.events("contact")
    assert np.diff([contact.tick, *ticks]).tolist() == [14] * len(ticks)
    pressed_N = [good.forces[tick][2] for tick in good.in_phase(Phase.EXPLORE) if tick > ticks[0]]
    assert np.mean(pressed_N[:-8]) == pytest.approx(-PRESS_N, rel=0.05)
    assert np.ptp(pressed_N[:-8]) < PRESS_N  # the dither
    steps = np.diff([good.tips[tick][:2] for tick in ticks], axis=0)
    assert np.hypot(*steps.T) == pytest.approx(np.full(len(steps), 0.5e-3), rel=0.02)


def test_the_torque_leads_to_the_hole(good):
    (contact,), (lost,) = good.events("contact"), good.events("contact lost")
    assert good.report.exploration_time_s == pytest.approx((lost.tick - contact.tick) * PERIOD_S)
    distance = hypot(START[0] - HOLE.x_m, START[1] - HOLE.y_m)
    assert good.report.actions == len(good.report.decisions)
    assert 0.5e-3 * good.report.actions < distance + 0.5e-3
    assert good.events("hole")[0].detail == f"found after {good.report.exploration_time_s:.3f} s"
    assert {record.state for record in good.report.decisions[1:]} == {"tx0 ty+"}


def test_the_policy_is_told_a_tick_ahead_where_it_will_choose(good):
    chosen = np.array([seen.reference_m[:2] for seen in good.policy.seen])
    assert np.abs(np.array(good.policy.foreseen[: len(chosen)]) - chosen).max() < 1e-9
    assert np.abs(np.diff(chosen, axis=0)).max() > 1e-4


def test_the_policy_sees_the_cue_at_the_tip(good):
    for seen in good.policy.seen[1:]:
        x, y, _ = seen.position_m
        toward = np.array([HOLE.x_m - x, HOLE.y_m - y])
        cue = np.array([seen.torque_Nm[1], -seen.torque_Nm[0]])
        assert cue @ toward > 0.9 * np.linalg.norm(cue) * np.linalg.norm(toward)
        assert seen.force_N[2] == pytest.approx(-PRESS_N, rel=0.25)


def test_the_lateral_force_in_the_hole_is_regulated_away(good):
    insertion = good.in_phase(Phase.INSERT)
    across = [hypot(*good.forces[tick][:2]) for tick in insertion]
    assert max(across) > 5.0  # the peg fell in beside the middle
    assert across[-1] < 2.0
    speeds = np.diff([good.tips[tick][:2] for tick in insertion], axis=0) / PERIOD_S
    assert np.hypot(*speeds.T).max() < 10e-3  # with the dither of a push


def test_a_trial_does_not_depend_on_the_one_before(good):
    policy = FollowTorque()
    task = build_task(policy)
    Trial(FakeWorld(Pit(0.0, 0.0, depth_m=5e-3)), policy, (0.5e-3, 0.0), task=task)
    second = Trial(FakeWorld(HOLE), policy, task=task)
    assert second.commands == good.commands
    assert second.report == good.report


def test_the_policy_draws_from_the_stream_of_its_trial():
    begun = []

    class Drawing(FollowTorque):
        def begin_trial(self, trial, rng):
            begun.append((trial, rng.random()))

    build_task(Drawing()).begin(TrialSetup(17, 99, START))
    assert begun == [(17, generator(99, Purpose.POLICY, 17).random())]


def test_a_policy_that_fails_at_the_beginning_leaves_a_report_of_the_trial():
    class Failing(FollowTorque):
        def begin_trial(self, trial, rng):
            raise PolicyError("strange:Failing", "it failed")

    task, setup = build_task(Failing()), TrialSetup(17, 99, START)
    with pytest.raises(PolicyError):
        task.begin(setup)
    assert task.report.setup is setup


@pytest.mark.parametrize("height_m", [-1.5e-3, -0.5e-3, 0.5e-3, 1.2e-3])
def test_depth_counts_from_the_surface_that_was_touched(height_m):
    trial = Trial(FakeWorld(HOLE, height_m=height_m))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.report.depth_m == pytest.approx(0.010, abs=5e-5)
    assert f"surface at {height_m * 1e3:.3f} mm" in trial.events("contact")[0].detail


def test_what_the_sensor_does_while_the_arm_comes_to_rest_is_not_tared_in():
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


def test_a_tilted_plate_is_not_taken_for_a_hole():
    world = FakeWorld(FAR_AWAY)
    world.slope = 0.05
    policy = Steps(displacements_m=[EAST] * 14)
    trial = Trial(world, policy, (-3e-3, 0.0), TaskConfig(time_limit_s=2.0))
    assert trial.report.outcome is Outcome.TIME_LIMIT
    assert trial.tips[-1][0] > 3.4e-3  # more than 0.3 mm lower than where it began, as deep as a drop
    assert Phase.INSERT not in trial.phases


def test_a_dent_is_not_taken_for_the_surface():
    # Too shallow to lose contact; depth goes on counting from the plate round it.
    dent = Pit(0.5e-3, 0.0, depth_m=0.2e-3, walls=False)
    trial = Trial(FakeWorld(dent), Steps(displacements_m=[EAST]), (0.0, 0.0), TaskConfig(time_limit_s=2.0))
    assert trial.report.outcome is Outcome.TIME_LIMIT
    assert Phase.INSERT not in trial.phases
    assert trial.report.depth_m == pytest.approx(0.2e-3, abs=2e-5)


def test_a_peg_that_sinks_against_friction_has_found_the_hole():
    # The wall goes on pushing back with more than the contact threshold.
    trial = Trial(FakeWorld(replace(HOLE, friction_N=2.0)))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.events("contact lost") == []
    assert len(trial.events("sunk below the surface")) == 1
    assert trial.report.depth_m == pytest.approx(0.010, abs=2.5e-4)  # contact and depth: the tolerance is enough


def test_a_false_drop_goes_back_to_exploration():
    dent = Pit(1e-3, 0.0, depth_m=0.25e-3, radius_m=0.6e-3, walls=False)
    hole = Pit(3e-3, 0.0)
    config = TaskConfig(press_kgf=0.15)
    policy = Steps(displacements_m=[EAST] * 9)
    trial = Trial(FakeWorld(dent, hole), policy, (0.0, 0.0), config)
    (drop,) = trial.events("false drop")
    assert float(drop.detail.split()[1]) == pytest.approx(0.25, abs=0.05)
    entered = [event.detail for event in trial.events("phase")][3:]
    assert entered == ["explore", "insert", "explore", "insert"]
    assert trial.report.outcome is Outcome.INSERTED
    first, second = trial.events("contact lost")
    (contact,) = trial.events("contact")
    assert trial.report.exploration_time_s == pytest.approx((second.tick - contact.tick) * PERIOD_S)
    assert drop.tick - first.tick > 70
    # No choice was made while the drop was looked into, and the steps went on where they had been.
    ticks = [record.tick for record in trial.report.decisions]
    assert not any(first.tick <= tick <= drop.tick for tick in ticks)
    assert 5 <= trial.report.actions <= 7


def test_the_peg_stays_inside_the_exploration_area():
    policy = Steps(displacements_m=[EAST] * 12 + [(0.0, -0.5e-3)] * 12)
    trial = Trial(FakeWorld(FAR_AWAY), policy, (0.0, 0.0), TaskConfig(time_limit_s=3.0))
    tips = np.array([trial.tips[tick] for tick in trial.in_phase(Phase.EXPLORE)])
    assert tips[:, 0].max() == pytest.approx(3.5e-3, abs=1e-6)
    assert tips[:, 1].min() == pytest.approx(-3.5e-3, abs=1e-6)
