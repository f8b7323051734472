"""An interval of 95 % holds the truth in 95 of a hundred draws: of a mean, of a difference, of a circle."""

from math import cos, sin, tau

import numpy as np
import pytest

from palpate.core.tasks.hole_survey import Sized, difference_of, fit_circle, mean_of
from palpate.core.tasks.hole_survey.estimate import student_t

DRAWS = 400


def share(found: list[tuple[Sized, float]]) -> float:
    return sum(abs(each.mm - true) <= each.within_mm for each, true in found) / len(found)


def test_intervals_of_few_touches_hold_the_truth_in_95_of_a_hundred() -> None:
    rng, found = np.random.default_rng(5), dict[str, list[tuple[Sized, float]]](mean=[], difference=[], circle=[])
    for _ in range(DRAWS):
        floor, plate = (5e-3 + rng.normal(0.0, 5e-6, 3)).tolist(), rng.normal(0.0, 5e-6, 3).tolist()
        found["mean"].append((mean_of(plate), 0.0))
        found["difference"].append((difference_of(floor, plate), 5.0))
        places = [(2e-3 * cos(tau * n / 8) + 1e-3, 2e-3 * sin(tau * n / 8)) for n in range(8)]
        circle = fit_circle((np.array(places) + rng.normal(0.0, 5e-6, (8, 2))).tolist())
        assert circle is not None
        t = student_t(5) * 1e3
        found["circle"].append((Sized(circle.radius_m * 1e3, t * circle.radius_sd_m), 2.0))
        found["circle"].append((Sized(circle.centre_m[0] * 1e3, t * circle.centre_sd_m[0]), 1.0))
    shares = {name: share(each) for name, each in found.items()}
    assert shares == {name: pytest.approx(0.95, abs=0.03) for name in shares}
