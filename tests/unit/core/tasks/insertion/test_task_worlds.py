"""The insertion task in other worlds: holes and plates elsewhere, dents, tilts, friction."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.core.ports import PERIOD_S
from palpate.core.ports.values import WrenchSample
from palpate.core.trial import Outcome, Phase, TaskConfig
from tests.unit.core.fake_world import WEIGHT_AND_BIAS_N, FakeWorld, Pit, Steps
from tests.unit.core.tasks.insertion.whole_trial import EAST, FAR_AWAY, HOLE, Trial, plus


@pytest.mark.parametrize("height_m", [-1.5e-3, -0.5e-3, 0.5e-3, 1.5e-3])
def test_depth_counts_from_the_surface_that_was_touched(height_m: float) -> None:
    trial = Trial(FakeWorld(HOLE, height_m=height_m))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.report.depth_m == pytest.approx(0.010, abs=5e-5)
    assert f"surface at {height_m * 1e3:.3f} mm" in trial.events("contact")[0].detail


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


def test_the_peg_stays_inside_the_exploration_area() -> None:
    policy = Steps(displacements_m=[EAST] * 12 + [(0.0, -0.5e-3)] * 12)
    trial = Trial(FakeWorld(FAR_AWAY), policy, (0.0, 0.0), TaskConfig(time_limit_s=3.0))
    tips = np.array([trial.tips[tick] for tick in trial.in_phase(Phase.EXPLORE)])
    assert tips[:, 0].max() == pytest.approx(3.5e-3, abs=1e-6)
    assert tips[:, 1].min() == pytest.approx(-3.5e-3, abs=1e-6)
