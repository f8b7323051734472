from math import cos, hypot, nan, radians, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Action, compass_actions


def test_eight_directions_are_named_by_the_axes_they_move_along():
    actions = compass_actions(0.001)
    assert [a.name for a in actions] == ["+x", "+x+y", "+y", "-x+y", "-x", "-x-y", "-y", "+x-y"]
    for action in actions:
        for axis, moved in zip("xy", action.displacement_m, strict=True):
            sign = {f"+{axis}": 1, f"-{axis}": -1}.get(next((s + axis for s in "+-" if s + axis in action.name), ""), 0)
            assert (moved > 0) - (moved < 0) == sign


def test_axis_steps_are_exact_and_opposite_steps_cancel_to_the_bit():
    actions = {a.name: a.displacement_m for a in compass_actions(0.001)}
    assert actions["+x"] == (0.001, 0.0)
    assert actions["-y"] == (0.0, -0.001)
    assert actions["+x+y"][0] == actions["+x+y"][1]
    for name, (x, y) in actions.items():
        opposite = actions[name.translate(str.maketrans("+-", "-+"))]
        assert (x + opposite[0], y + opposite[1]) == (0.0, 0.0)
        assert not {repr(x), repr(y)} & {"-0.0"}


@given(st.floats(1e-5, 0.1), st.integers(2, 72))
def test_directions_are_equally_spaced_and_equally_long(step_m, directions):
    actions = compass_actions(step_m, directions)
    assert len({a.name for a in actions}) == directions
    for k, action in enumerate(actions):
        angle = radians(360.0 * k / directions)
        assert hypot(*action.displacement_m) == pytest.approx(step_m, rel=1e-12)
        wanted = (step_m * cos(angle), step_m * sin(angle))
        assert action.displacement_m == pytest.approx(wanted, abs=1e-14)


@pytest.mark.parametrize(("directions", "names"), [(2, ["0deg", "180deg"]), (4, ["0deg", "90deg", "180deg", "270deg"])])
def test_other_numbers_of_directions_are_named_by_angle(directions, names):
    assert [a.name for a in compass_actions(0.001, directions)] == names


@pytest.mark.parametrize(
    ("step_m", "directions", "field"),
    [
        (0.0, 8, "step_m"),
        (-1.0, 8, "step_m"),
        (nan, 8, "step_m"),
        (float("inf"), 8, "step_m"),
        (0.001, 1, "directions"),
    ],
)
def test_unusable_settings_are_refused(step_m, directions, field):
    with pytest.raises(ConfigurationError) as refused:
        compass_actions(step_m, directions)
    assert refused.value.field == f"actions.{field}"


def test_an_action_must_be_finite():
    with pytest.raises(ConfigurationError, match="finite"):
        Action("nowhere", (0.0, nan))
