"""Where states are drawn: in a good policy every arrow points to the middle."""

from math import atan2, hypot, pi

import pytest

from palpate.adapters.visualisation.report.policy_layout import blocks_of, informative
from tests.unit.adapters.visualisation.report.samples import ACTIONS, POSITION, SIGNS, TORQUE, policy, row

SIGN = {"-": -1, "0": 0, "+": 1}


def nearest_action(x: float, y: float) -> str:
    angle = atan2(y, x)
    return min(
        ACTIONS,
        key=lambda a: abs((atan2(a.displacement_mm[1], a.displacement_mm[0]) - angle + pi) % (2 * pi) - pi),
    ).name


def test_the_paper_s_states_make_two_maps() -> None:
    blocks = blocks_of(policy(*(row(state, "+x") for state in (*POSITION, *TORQUE))), 3)
    assert [len(block.places) for block in blocks] == [8, 9]
    assert blocks[0].gap is not None
    assert blocks[0].gap[:2] == (1, 1)
    assert (1, 1) not in blocks[0].places.values()
    assert blocks[1].places["tx0 ty0"] == (1, 1)


def test_a_position_lies_where_it_is_seen_from_above() -> None:
    places = blocks_of(policy(*(row(state, "+x") for state in (*POSITION, *TORQUE))), 99)[0].places
    # x to the right, y downwards.
    assert places["x- y0"] == (0, 1)
    assert places["x+ y0"] == (2, 1)
    assert places["x0 y-"] == (1, 0)
    assert places["x+ y+"] == (2, 2)


@pytest.mark.parametrize("state", [f"tx{a} ty{b}" for a in SIGNS for b in SIGNS if (a, b) != ("0", "0")])
def test_the_torque_rule_points_to_the_middle(state: str) -> None:
    places = blocks_of(policy(*(row(name, "+x") for name in (*POSITION, *TORQUE))), 99)[1].places
    tx, ty = SIGN[state[2]], SIGN[state[6]]
    # The rule of the hand-written comparator: the hole is at heading (-ty, tx).
    action = next(a for a in ACTIONS if a.name == nearest_action(-ty, tx))
    column, line = places[state]
    dx, dy = (value / hypot(*action.displacement_mm) for value in action.displacement_mm)
    # One step of that action in the picture, in which y points down as the lines are counted.
    apart = hypot(column - 1, line - 1)
    assert (column + dx * apart, line + dy * apart) == pytest.approx((1, 1))


@pytest.mark.parametrize("states", [("cluster 0", "cluster 1"), ("x- y-", "other"), POSITION, ("x- y- > x0 y0",)])
def test_other_states_stand_in_rows(states: tuple[str, ...]) -> None:
    (block,) = blocks_of(policy(*(row(state, "+x") for state in states)), 99)
    assert list(block.places) == list(states)
    assert len(set(block.places.values())) == len(states)
    assert block.columns == ()


def test_of_many_states_those_that_say_something() -> None:
    table = [row("a", "+x", visits=0), row("b", "+x", visits=80), row("c", "+x", visits=8)]
    table += [row("d", "-x", visits=0, source="programmed"), row("e", "+x", visits=16)]
    assert [line.state for line in informative(policy(*table), 99)] == ["b", "c", "d", "e"]
    assert [line.state for line in informative(policy(*table), 2)] == ["b", "e"]
    nothing = policy(row("a", "+x", visits=0), row("b", "+x", visits=0))
    assert len(informative(nothing, 99)) == 2
