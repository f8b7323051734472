"""The insertion task in other worlds: holes and plates elsewhere, dents, tilts, friction."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.core.ports import PERIOD_S
from palpate.core.ports.values import WrenchSample
from palpate.core.trial import Outcome, Phase, TaskConfig
from tests.unit.core.fake_world import TOOL, WEIGHT_AND_BIAS_N, FakeWorld, FollowTorque, Pit, Steps, build_task
from tests.unit.core.tasks.insertion.whole_trial import EAST, FAR_AWAY, HOLE, START, Trial, plus


@pytest.mark.parametrize("height_m", [-1.5e-3, -0.5e-3, 0.5e-3, 1.5e-3])
def test_depth_counts_from_the_surface_that_was_touched(height_m: float) -> None:
    trial = Trial(FakeWorld(HOLE, height_m=height_m))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.report.depth_m == pytest.approx(0.010, abs=5e-5)
    assert f"surface at {height_m * 1e3:.3f} mm" in trial.events("contact")[0].detail


def test_a_hole_right_below_the_start() -> None:
    trial = Trial(FakeWorld(Pit(*START)))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.report.exploration_time_s == 0.0
    assert trial.report.actions == 0
    assert trial.policy.learned == []
    assert Phase.EXPLORE not in trial.phases
    assert trial.events("hole")[0].detail == "the approach went straight into it"
    assert trial.events("contact") == []
    assert trial.report.depth_m == pytest.approx(0.010, abs=5e-5)


@pytest.mark.parametrize("proved", [True, False])
def test_the_edge_of_the_hole_is_not_taken_for_the_surface(proved: bool) -> None:
    # It bears the peg for a moment on its way in, and the filtered force shows that when the tip is deeper already.
    world, samples = FakeWorld(Pit(*START)), iter(range(7))

    def edge(sample: WrenchSample) -> WrenchSample:
        borne = world.tip_m[2] > 0.0 and next(samples, None) is not None
        return replace(sample, force_N=plus(sample.force_N, (0.0, 0.0, -2.0))) if borne else sample

    world.spoil = edge
    trial = Trial(world, task=build_task(FollowTorque(), proves=proved))
    assert float(trial.events("contact")[0].detail.split()[2]) > 0.25  # mm: more than the depth may fall short by
    assert trial.report.actions == 0
    assert trial.report.outcome is Outcome.INSERTED
    assert 0.010 < trial.tips[-1][2] < 0.011  # on the floor, pressing


def test_an_arm_that_stands_deep_is_lifted_straight_up_first() -> None:
    # As after a trial that ended in the hole.
    below = Pit(0.5e-3, 0.5e-3, depth_m=0.02)
    trial = Trial(FakeWorld(below, start_m=(0.5e-3, 0.5e-3, 9e-3)), start_m=(0.0, 2e-3))
    lift = trial.in_phase(Phase.LIFT)
    assert len(lift) > 60
    assert np.ptp([trial.tips[tick][:2] for tick in lift], axis=0).max() < 1e-6
    heights = np.array([trial.tips[tick][2] for tick in lift])
    assert (np.diff(heights) < 0.0).all()
    assert heights[-1] == pytest.approx(-3e-3, abs=1e-5)
    assert np.abs(np.diff(heights)).max() == pytest.approx(0.02 * PERIOD_S, rel=1e-3)
    assert trial.report.outcome is Outcome.INSERTED


def test_what_the_sensor_does_while_the_arm_comes_to_rest_is_not_tared_in() -> None:
    world = FakeWorld(HOLE)
    reads = iter(range(10_000))

    def ring(sample: WrenchSample) -> WrenchSample:
        # Until 26 ticks after the arm has arrived, as in the good trial.
        return replace(sample, force_N=plus(sample.force_N, (3.0, 2.0, 1.0))) if next(reads) <= 16 + 26 else sample

    world.spoil = ring
    trial = Trial(world)
    assert trial.events("phase")[1].tick == 16
    numbers = [float(word) for word in trial.events("tare")[0].detail.split()[:3]]
    assert numbers == pytest.approx(WEIGHT_AND_BIAS_N, rel=1e-5)


def test_a_tilted_plate_is_not_taken_for_a_hole() -> None:
    world = FakeWorld(FAR_AWAY)
    world.slope = 0.05
    policy = Steps(displacements_m=[EAST] * 14)
    trial = Trial(world, policy, (-3e-3, 0.0), TaskConfig(time_limit_s=2.0))
    assert trial.report.outcome is Outcome.TIME_LIMIT
    assert trial.tips[-1][0] > 3.4e-3  # more than 0.3 mm lower than where it began, as deep as a drop
    assert Phase.INSERT not in trial.phases


def test_a_dent_is_not_taken_for_the_surface() -> None:
    # Too shallow to lose contact; depth goes on counting from the plate round it.
    dent = Pit(0.5e-3, 0.0, depth_m=0.2e-3, walls=False)
    trial = Trial(FakeWorld(dent), Steps(displacements_m=[EAST]), (0.0, 0.0), TaskConfig(time_limit_s=2.0))
    assert trial.report.outcome is Outcome.TIME_LIMIT
    assert Phase.INSERT not in trial.phases
    assert trial.report.depth_m == pytest.approx(0.2e-3, abs=2e-5)


def test_a_peg_that_sinks_against_friction_has_found_the_hole() -> None:
    # The wall goes on pushing back with more than the contact threshold.
    trial = Trial(FakeWorld(replace(HOLE, friction_N=2.0)))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.events("contact lost") == []
    assert len(trial.events("sunk below the surface")) == 1
    assert trial.report.depth_m == pytest.approx(0.010, abs=2.5e-4)  # contact and depth: the tolerance is enough


def test_a_false_drop_goes_back_to_exploration() -> None:
    dent = Pit(1e-3, 0.0, depth_m=0.25e-3, walls=False)
    hole = Pit(3e-3, 0.0)
    config = TaskConfig(contact_kgf=0.45)
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
    assert 6 <= trial.report.actions <= 7


def test_a_false_drop_does_not_stop_the_clock() -> None:
    dent = Pit(1e-3, 0.0, depth_m=0.25e-3, walls=False)
    config = TaskConfig(contact_kgf=0.45, time_limit_s=2.5)
    trial = Trial(FakeWorld(dent), Steps(displacements_m=[EAST] * 3), (0.0, 0.0), config)
    assert len(trial.events("false drop")) == 1
    assert trial.report.outcome is Outcome.TIME_LIMIT
    assert trial.report.exploration_time_s == pytest.approx(2.5)


def test_the_peg_stays_inside_the_exploration_area() -> None:
    policy = Steps(displacements_m=[EAST] * 12 + [(0.0, -0.5e-3)] * 12)
    trial = Trial(FakeWorld(FAR_AWAY), policy, (0.0, 0.0), TaskConfig(time_limit_s=3.0))
    tips = np.array([trial.tips[tick] for tick in trial.in_phase(Phase.EXPLORE)])
    assert tips[:, 0].max() == pytest.approx(3.5e-3, abs=1e-6)
    assert tips[:, 1].min() == pytest.approx(-3.5e-3, abs=1e-6)


@pytest.mark.parametrize("proved", [True, False])
def test_a_peg_that_an_edge_holds_is_let_in(proved: bool) -> None:
    # Friction on the edge bears it, so that neither a loss of contact nor its depth shows the hole.
    world, reads = FakeWorld(HOLE), iter(range(10_000))

    def held(sample: WrenchSample) -> WrenchSample:
        across_N = 9.0 if next(reads) in range(170, 178) else 0.0
        torque_Nm = plus(sample.torque_Nm, (0.0, TOOL.tip_from_sensor_m * across_N, 0.0))
        return replace(sample, force_N=plus(sample.force_N, (across_N, 0.0, 0.0)), torque_Nm=torque_Nm)

    world.spoil = held
    trial = Trial(world, task=build_task(FollowTorque(), proves=proved))
    # Logs from before proofs of contact replay as they were.
    assert [event.name for event in trial.report.events].count("caught on an edge") == proved
    assert trial.report.outcome is Outcome.INSERTED


def test_one_deep_sample_makes_no_hole_of_a_false_drop() -> None:
    world, reads = FakeWorld(HOLE), iter(range(10_000))

    def dropped(sample: WrenchSample) -> WrenchSample:
        read = next(reads)
        lost = 0.0 if read not in range(170, 176) else 5.0 if read < 175 else 7.0
        return replace(sample, force_N=plus(sample.force_N, (0.0, 0.0, lost)))

    world.spoil = dropped
    trial = Trial(world)
    assert trial.events("false drop")
    assert trial.report.outcome is Outcome.INSERTED
