"""A circle through touched places; places that lie on none are no circle."""

from math import cos, sin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.tasks.hole_survey import fit_circle

METRES = st.floats(-0.05, 0.05)


@settings(max_examples=40)
@given(METRES, METRES, st.floats(1e-4, 0.05), st.floats(0.0, 6.0))
def test_places_on_a_circle_give_it_back(x: float, y: float, radius: float, turn: float) -> None:
    # Not evenly: three on one side.
    places = [(x + radius * cos(turn + a), y + radius * sin(turn + a)) for a in (0.0, 0.4, 0.8, 2.5, 4.0)]
    circle = fit_circle(places)
    assert circle is not None
    assert (*circle.centre_m, circle.radius_m) == pytest.approx((x, y, radius), abs=1e-8)


@pytest.mark.parametrize("places", [[(0.0, 0.0)] * 4, [(0.0, n * 1e-3) for n in range(5)]])
def test_places_on_no_circle_give_none(places: list[tuple[float, float]]) -> None:
    assert fit_circle(places) is None
