"""The verdict on a job: what is refused, in which words, and the task and policy that it names."""

from dataclasses import replace

import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.job import (
    Job,
    LimitsConfig,
    PartConfig,
    PlaceConfig,
    ToolConfig,
    derived_settings,
    judge,
    require_measurable,
)
from palpate.core.ports import SensorFacts

QUIET = SensorFacts(0.1, 0.004)
TIGHT = PartConfig(peg_mm=12.0, hole_mm=12.018, depth_mm=20.0, depth_tolerance_mm=0.3, friction_max=0.4)


def verdict(part=TIGHT, sensor=QUIET, task="", force_N=30.0, **place):
    job = Job(part, ToolConfig(), PlaceConfig(**place), LimitsConfig(force_N=force_N))
    return judge(job, sensor, step_mm=0.005, task=task)


def test_a_round_peg_that_fits_is_inserted_by_a_belief():
    found = verdict(position_uncertainty_mm=2.0)
    assert not found.reasons
    assert (found.choice.task, found.choice.learner, found.choice.policy) == ("insertion", "belief", "")
    assert found.choice.command == "palpate train --learner belief"


def test_a_tilted_peg_that_no_press_frees_is_refused_with_what_would_be_right():
    refused = verdict(tilt_uncertainty_mrad=6.0)
    assert refused.regime.held_N > refused.derived.insertion_press_N
    (reason,) = refused.reasons
    assert reason == (
        "a peg tilted by 6 mrad jams at 3.2 mm (J = 4.1): press with at least 20 N"
        " (limits.force_N of at least 50), or reduce the tilt to 3 mrad"
    )
    # As it says: with that tilt the job is done, and with that force.
    assert not verdict(tilt_uncertainty_mrad=2.9, task="insertion").reasons
    assert not verdict(tilt_uncertainty_mrad=6.0, task="insertion", force_N=50.1).reasons


def test_a_tolerance_below_four_standard_deviations_is_refused_with_both_figures():
    noisy = SensorFacts(0.9, 0.004)
    (reason,) = verdict(sensor=noisy, task="insertion", part=replace(TIGHT, depth_tolerance_mm=0.2)).reasons
    assert reason.startswith("the depth tolerance, 0.2 mm, is below four standard deviations of depth, 0.5")
    assert "use a force sensor with at most 0.3" in reason
    # The one that is named is enough.
    assert not verdict(sensor=SensorFacts(0.34, 0.004), part=replace(TIGHT, depth_tolerance_mm=0.2)).reasons


def test_a_run_is_refused_by_the_tolerance_that_its_settings_have():
    job = Job()
    require_measurable(job, QUIET, step_mm=0.005, tolerance_mm=0.2, press_N=4.9)
    with pytest.raises(ConfigurationError, match=r"depth_tolerance_mm must be at least 0\.063, four"):
        require_measurable(job, QUIET, step_mm=0.005, tolerance_mm=0.05, press_N=4.9)


def test_a_contact_that_noise_hides_is_refused_with_three_figures_and_remedies_that_suffice():
    soft = Job(PartConfig(depth_tolerance_mm=2.0), replace(ToolConfig(), axial_N_per_mm=1.0))
    (reason,) = judge(soft, SensorFacts(0.5, 0.004), step_mm=0.005).reasons
    assert reason == (
        "no contact can be verified: this takes 1 s (longest window: 0.4 s) with a dither of 0.36 N in a"
        " noise of 0.5 N: raise limits.speed_mm_s to 38 or use a force sensor with at most 0.27 N of noise or use a"
        " gripper of at least 1.9 N/mm"
    )
    for changed in (
        replace(soft, limits=LimitsConfig(speed_mm_s=38.0)),
        replace(soft, tool=replace(soft.tool, axial_N_per_mm=1.9)),
    ):
        assert not judge(changed, SensorFacts(0.5, 0.004), step_mm=0.005).reasons
    assert not judge(soft, SensorFacts(0.27, 0.004), step_mm=0.005).reasons


def test_a_gripper_too_stiff_for_the_encoders_is_refused_also_before_a_run():
    stiff = replace(Job(), tool=replace(ToolConfig(), axial_N_per_mm=500.0))
    (reason,) = judge(stiff, QUIET, step_mm=0.005).reasons
    assert "mostly of the encoders' steps: use a gripper of at most" in reason
    with pytest.raises(ConfigurationError, match=r"axial_N_per_mm = 500\.0: no contact can be verified"):
        require_measurable(stiff, QUIET, step_mm=0.005, tolerance_mm=0.2, press_N=4.9)
    # By hand it is pressed harder.
    require_measurable(stiff, QUIET, step_mm=0.005, tolerance_mm=0.2, press_N=20.0)


def test_a_gripper_too_stiff_across_for_a_push_within_the_limit_is_refused_with_remedies_that_suffice():
    stiff = replace(Job(), tool=replace(ToolConfig(), lateral_N_per_mm=500.0))
    (reason,) = judge(stiff, QUIET, step_mm=0.005).reasons
    assert reason.startswith(
        "no wall of the hole can be verified: with 500 N/mm across this takes a push of 7.68 N, at"
    )
    assert "raise limits.force_N to 36 or use a gripper of at most 390 N/mm across" in reason
    with pytest.raises(ConfigurationError, match=r"lateral_N_per_mm = 500\.0: no wall of the hole can be verified"):
        require_measurable(stiff, QUIET, step_mm=0.005, tolerance_mm=0.2, press_N=4.9)
    assert not judge(replace(stiff, limits=LimitsConfig(force_N=36.0)), QUIET, step_mm=0.005).reasons
    # In a shallow hole the descent itself bends the gripper by less than the budget.
    shallow = replace(stiff, part=replace(PartConfig(), depth_mm=4.0))
    assert not judge(shallow, QUIET, step_mm=0.005).reasons


def test_an_area_above_that_of_a_belief_is_left_to_the_torque_rule_where_it_can_see_the_hole():
    loose = PartConfig()
    found = verdict(loose, position_uncertainty_mm=9.0)
    assert (found.choice.policy, found.reasons) == ("torque", ())
    (reason,) = verdict(loose, position_uncertainty_mm=9.0, tilt_uncertainty_mrad=4.0).reasons
    assert "locate the hole within 7.5 mm" in reason


def test_shapes_are_inserted_corner_first_unless_their_corners_are_too_near():
    square = PartConfig(shape="square", peg_mm=20.0, hole_mm=20.1, depth_tolerance_mm=0.5)
    found = verdict(square, yaw_uncertainty_deg=5.0)
    assert found.choice.command == "palpate run --policy corner-first --task insertion-6dof"
    assert not found.reasons
    (reason,) = verdict(replace(square, peg_mm=5.0, hole_mm=5.05)).reasons
    assert "3.5 mm from the axis" in reason
    (reason,) = verdict(replace(square, shape="keyed", peg_mm=9.0, hole_mm=9.05, flat_mm=0.9)).reasons
    assert "the flat is 3.6 mm from the axis" in reason


def test_a_force_limit_too_low_for_the_noise_is_refused():
    (reason,) = verdict(PartConfig(depth_tolerance_mm=1.0), SensorFacts(0.6, 0.01), force_N=3.0).reasons
    assert "raise limits.force_N to 5.7" in reason


def test_a_shape_whose_turn_is_not_known_is_not_pushed_straight_in():
    square = PartConfig(shape="square", peg_mm=20.0, hole_mm=20.1, depth_tolerance_mm=0.5)
    (reason,) = verdict(square, task="insertion", yaw_uncertainty_deg=5.0).reasons
    # 0.05 mm over half a side of 10 mm.
    assert reason.endswith("use --task insertion-6dof, or reduce the yaw to 0.29 degrees")
    assert not verdict(square, task="insertion", yaw_uncertainty_deg=0.28).reasons


def test_a_wide_tilted_peg_with_friction_is_refused_where_it_wedges_and_cautioned_where_it_does_not_jam():
    wide = PartConfig(peg_mm=45.5, hole_mm=45.53, depth_mm=39.0, depth_tolerance_mm=0.5, friction_max=0.6)
    (reason,) = verdict(wide, tilt_uncertainty_mrad=4.4).reasons
    # 0.6 * 4.4e-3 * 45.5 / 0.03
    assert reason == (
        "a peg tilted by 4.4 mrad may wedge in the mouth of the hole (W = 4.0): reduce the tilt to 1.8 mrad"
    )
    assert not verdict(wide, tilt_uncertainty_mrad=1.7).reasons
    short = verdict(replace(wide, hole_mm=45.7, depth_mm=9.0), tilt_uncertainty_mrad=18.0)
    assert "W = 2.5): a tilt below 12 mrad helps" in short.caution


def test_a_peg_that_is_tight_for_its_size_is_given_the_time_and_named():
    square = PartConfig(shape="square", peg_mm=60.0, hole_mm=60.06, depth_tolerance_mm=0.9)
    assert verdict(square).caution == (
        "a play of 1 mrad is little for what a push shows of the turn: about 10 attempts, and a time limit to match;"
        " a radial clearance of 0.06 mm helps"
    )
    assert verdict(replace(square, hole_mm=60.13)).caution == ""
    limits = [
        derived_settings(Job(replace(square, hole_mm=hole_mm)), QUIET, "insertion-6dof")["task"]["time_limit_s"]
        for hole_mm in (60.06, 60.2)
    ]
    assert limits == [60.0, 20.0]
