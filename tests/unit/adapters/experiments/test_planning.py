"""Worlds of the simulated trials of a plan, and their series."""

from pathlib import Path

import pytest

from palpate.adapters.config import compose, read_job
from palpate.adapters.experiments.planning import drawn_world, run_series, simulate

DOWEL = read_job(Path(__file__).parents[4] / "examples" / "jobs" / "dowel-12-h7.toml")


def planned(**place):
    return compose("job", "q-learning", {"place": place, "seed": 3}, job=DOWEL)


def test_each_trial_has_a_world_from_the_ranges_of_the_job():
    config = planned()
    worlds = [drawn_world(config, trial, {}).cell for trial in range(200)]
    for name, least, most in (
        ("friction", 0.1, 0.4), ("tilt", 0.0, 2.0), ("height", -0.5, 0.5), ("noise", 0.08, 0.125),
        ("axial", 18.0, 22.0),
    ):  # fmt: skip
        values = [
            {
                "friction": cell.peg.friction, "tilt": cell.tilt_mrad, "height": cell.hole_height_error_mm,
                "noise": cell.sensor.force_noise_N, "axial": cell.compliance.axial_N_per_mm,
            }[name]
            for cell in worlds
        ]  # fmt: skip
        span = 0.05 * (most - least)
        assert least <= min(values) < least + span, name
        assert most - span < max(values) <= most, name
    # All of a gripper's springs are of the same batch.
    assert {round(cell.compliance.lateral_N_per_mm / cell.compliance.axial_N_per_mm, 9) for cell in worlds} == {2.0}


def test_a_world_depends_on_seed_and_trial_alone_and_keeps_a_stated_friction():
    config = planned()
    assert drawn_world(config, 7, {}) == drawn_world(config, 7, {})
    assert drawn_world(config, 7, {"peg": {"friction": 0.2}}).cell.peg.friction == 0.2
    assert drawn_world(config, 7, {}).task == config.task


def test_a_rule_counts_every_trial_and_a_learner_all_but_the_first():
    rule = next(simulate(planned(position_uncertainty_mm=0.0), "oracle", 2, 1, {}))
    assert (len(rule[0]), rule[1]) == (2, 2)
    learner = compose("job", "belief", {"seed": 3}, job=DOWEL)
    counted, ran = next(simulate(learner, "", 2, 1, {}))
    assert ([each.report.setup.index for each in counted], ran) == ([1], 2)


def test_a_trip_ends_one_trial_and_no_more():
    config = compose("job", "q-learning", {"supervision": {"max_force_rate_N_s": 150.0}, "seed": 3}, job=DOWEL)
    trips = [scored.trip.partition(":")[0] for scored in run_series(config, "torque", range(2))]
    assert trips == ["FORCE_RATE", "FORCE_RATE"]


@pytest.mark.parametrize("arm", ["ur10", "ur5e"])
def test_the_oracle_knows_each_trials_hole(arm):
    config = compose("job", "q-learning", {"seed": 3}, job={**DOWEL, "arm": {"name": arm}})
    assert all(scored.success for scored in run_series(config, "oracle", range(2)))
