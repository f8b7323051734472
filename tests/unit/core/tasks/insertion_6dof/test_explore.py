"""A tool that is caught while it is lifted gives way; no trial without a fault ends in a trip for it."""

import pytest

from benchmarks.insertion_6dof import config_of, trials


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
