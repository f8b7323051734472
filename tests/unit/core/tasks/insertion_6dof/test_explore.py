"""A tool that is caught while it is lifted gives way; no trial without a fault ends in a trip for it."""

import pytest

from palpate.adapters.config import overlay
from tests.support.fault_trials import Case, run_cases, sensor_faults
from tests.support.pegs_6dof import config_of, trials


@pytest.mark.parametrize(
    ("conditions", "seed", "trial"),
    [
        pytest.param("tightest", 3, 26, id="pinched in the mouth of the hole, by 2.7 N where 2.45 N trip"),
        pytest.param("asked", 90421, 184, id="wedged, and its height driven up while it is pushed"),
    ],
)
def test_a_square_that_something_holds_is_freed(conditions: str, seed: int, trial: int) -> None:
    config = config_of("square", conditions, "zebra-zero", {})
    [(_, _, success, _, peak_force_N, *_)] = trials(config, "corner-first", seed, range(trial, trial + 1))
    assert success
    assert peak_force_N < 20.0


def test_a_tool_that_goes_back_to_where_it_was_answered_may_meet_a_wall_there() -> None:
    config = overlay(config_of("hexagon", "asked", "zebra-zero", {}), {"cell": {"sensor": {"force_noise_N": 0.3}}})
    [(_, _, success, *_)] = trials(config, "corner-first", 41001, range(1))
    assert success


@pytest.mark.parametrize(
    ("arm", "phase", "seed", "fault"),
    [
        pytest.param(
            "ur5",
            "insert",
            97301,
            "of 1 s, sign flipped",
            id="it leads the peg back out from the floor, to where it would pass for another",
        ),
        pytest.param("ur5", "insert", 98501, "of 1 s, sign flipped", id="it leans, and is wedged as it is drawn back"),
        pytest.param("zebra-zero", "insert", 369822, "of 1 s, times 0.3", id="it leans further as it is drawn back"),
        pytest.param("ur5", "explore", 98500, "of 1 s, times 0.3", id="long strokes seem to be none: 425 N by scatter"),
    ],
)
def test_a_repeated_force_that_is_turned_bends_the_gripper_no_further(
    arm: str, phase: str, seed: int, fault: str
) -> None:
    config = config_of("square", "asked", arm, {})
    [chosen] = [each for each in sensor_faults() if each.name.endswith(f"{fault}, fresh noise")]
    [[run]] = run_cases(config, [Case(chosen, phase, seed)], "corner-first")
    assert run.latched
    assert run.peak_force_N < 60.0
