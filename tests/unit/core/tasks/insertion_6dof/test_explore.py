"""A tool that is caught while it is lifted complies; no trial without a fault ends in a trip for it."""

from types import SimpleNamespace

import pytest

from palpate.adapters.experiments import baseline, build_perception, build_task, ready_pose
from palpate.core.policy import Action, ControllerKind, Spatial
from tests.support.fault_trials import Case, run_cases, sensor_faults
from tests.support.pegs_6dof import config_of, trials


@pytest.mark.parametrize(
    ("conditions", "seed", "trial"),
    [
        pytest.param("tightest", 3, 31, id="stuck in the hole, where it does not come out again"),
        pytest.param("asked", 90421, 184, id="wedged, and its height driven up while it is pushed"),
    ],
)
def test_a_square_that_something_holds_is_freed(conditions, seed, trial):
    config = config_of("square", conditions, "zebra-zero", {})
    [(_, _, success, _, peak_force_N, *_)] = trials(config, "corner-first", seed, range(trial, trial + 1))
    assert success
    assert peak_force_N < 25.0


@pytest.mark.parametrize(
    ("shape", "arm", "trial"),
    [
        pytest.param("square", "panda", 5, id="pushes to a wall in the hole were ended too early"),
        pytest.param("triangle", "panda", 2, id="the same, just below the mouth", marks=pytest.mark.nightly),
    ],
)
def test_a_wall_gives_the_budget_back(shape, arm, trial):
    [(_, outcome, *_)] = trials(config_of(shape, "asked", arm, {}), "corner-first", 177, range(trial, trial + 1))
    assert outcome == "inserted"


@pytest.mark.parametrize(
    ("arm", "phase", "seed"),
    [
        pytest.param("zebra-zero", "settle", 24301, id="verified by the force of the approach"),
        pytest.param("zebra-zero", "transfer", 60, id="verified by chance while wedged", marks=pytest.mark.nightly),
        pytest.param("ur5", "approach", 60, id="the same with another arm", marks=pytest.mark.nightly),
    ],
)
def test_a_growing_lag_is_found_before_it_bends_the_gripper(arm, phase, seed):
    config = config_of("square", "asked", arm, {})
    [chosen] = [each for each in sensor_faults() if each.name == "force later by 0.2 s a second, new times"]
    [[run]] = run_cases(config, [Case(chosen, phase, seed)], "corner-first")
    assert run.latched
    assert run.peak_force_N < 30.0


CONFIG = config_of("square", "asked", "zebra-zero", {})


@pytest.fixture
def explore():
    """The exploration of a square peg, at its beginning."""
    corner_first = baseline("corner-first", CONFIG, tuple)
    explore = build_task(CONFIG, ready_pose(CONFIG), build_perception(CONFIG), corner_first)._explore
    explore.begin((0.0, 0.0))
    return explore


@pytest.mark.parametrize(
    ("tilt_rad", "deep_m", "turns"),
    [(0.029, 6e-3, True), (0.031, 6e-3, False), (-0.031, 6e-3, True), (0.031, 1e-3, True)],
)
def test_withdrawn_tool_complies_with_a_torque_unless_no_peg_in_a_hole_tilts_that_far(explore, tilt_rad, deep_m, turns):
    rates, free = [], SimpleNamespace(spent=False, direction=None, moves_on=lambda: None, dither_m_s=lambda: 0.0)
    explore._spatial, explore._rate_rad_s, explore._step_m = Spatial(ControllerKind.WITHDRAW), (0.0,) * 3, (0.0, 0.0)
    explore._state.surface_m, explore._monitor = 0.0, free
    explore._measurement.live_torque_at_tip_Nm = lambda: (0.1, 0.0, 0.0)
    explore._measurement.force_N, explore._measurement.position_m = (0.0, 0.0, -1.0), (0.0, 0.0, deep_m)
    explore._motion.turn_rad, explore._motion.reference_m = (tilt_rad, 0.0, 0.0), (0.0, 0.0, deep_m)
    explore._motion.turn, explore._about_pivot = rates.append, lambda velocity, turned: velocity
    explore._advance()
    assert rates == ([pytest.approx((0.04, 0.0, 0.0))] if turns else [])


@pytest.mark.parametrize(("lag_gain", "compliance"), [(0.5, 1.0), (2.0, 0.5), (4.0, 0.25)])
def test_tool_complies_less_the_later_its_arm_follows(explore, lag_gain, compliance):
    # The gain of the compliance times this lag is as stated.
    lag_s = lag_gain / (CONFIG.control.lateral_stiffness_N_per_mm * 1e3 * explore._push_m_per_N_s)
    explore._motion.reference_m, explore._measurement.position_m = (0.01 * lag_s, 0.0, 0.0), (0.0, 0.0, 0.0)
    for _ in range(2):
        # Each trial finds the lag out by itself.
        explore.begin((0.0, 0.0))
        assert explore._give == 1.0
        explore._look_for_lag((0.01, 0.0, 0.0))
        assert explore._give == pytest.approx(compliance)


@pytest.mark.parametrize(
    ("tilt_rad", "tip_m", "from_encoders_m", "low"),
    [(0.0, -1e-3, -1e-3, False), (0.0, -2e-4, -1e-3, True), (0.0, -1e-3, -2e-4, True), (0.1, -1e-3, -1e-3, True)],
)
def test_lowest_corner_counts_as_in_contact(explore, tilt_rad, tip_m, from_encoders_m, low):
    explore._state.surface_m, explore._motion.turn_rad = 0.0, (0.0, tilt_rad, 0.0)
    explore._measurement.position_m = (0.0, 0.0, from_encoders_m)
    explore._measurement.force_N = (0.0, 0.0, 0.0)
    explore._measurement.tip_depth_m = tip_m
    assert explore._low is low


@pytest.mark.parametrize(("rise_m", "lifted_m"), [(1e-3, 1.5e-3), (0.0, 0.0)])
def test_lift_first_relieves_the_gripper(explore, rise_m, lifted_m):
    explore._motion.reference_m, explore._motion.look_at_joints = (0.0, 0.0, 0.5e-3), lambda: None
    explore._motion.turn_rad, explore._measurement.tip_depth_m = (0.0, 0.0, 0.0), 0.0
    explore._monitor = SimpleNamespace(push=lambda direction: None)
    explore._begin(Action("lift", (0.0, 0.0), spatial=Spatial(ControllerKind.LIFT, rise_m=rise_m)))
    assert explore._rise_m == pytest.approx(lifted_m)
