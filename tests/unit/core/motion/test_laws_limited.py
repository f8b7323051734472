"""The speed limit that all laws share."""

from __future__ import annotations

from math import hypot

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.motion.laws import limited

components = st.floats(-10.0, 10.0)


@given(st.tuples(components, components, components), st.floats(1e-6, 1.0))
def test_a_velocity_is_shortened_and_keeps_its_direction(velocity: tuple[float, float, float], limit: float) -> None:
    speed = hypot(*velocity)
    result = limited(velocity, limit)
    if speed <= limit * (1 - 1e-12):
        assert result == velocity
    else:
        assert hypot(*result) == pytest.approx(min(speed, limit), rel=1e-12)
        assert result == pytest.approx([v * min(limit / speed, 1.0) for v in velocity], rel=1e-9, abs=1e-15)


def test_a_velocity_below_the_limit_is_not_touched() -> None:
    velocity = (0.003, 0.0, -0.004)
    assert limited(velocity, 0.005) is velocity
    assert limited((0.0, 0.0, 0.0), 1e-6) == (0.0, 0.0, 0.0)
