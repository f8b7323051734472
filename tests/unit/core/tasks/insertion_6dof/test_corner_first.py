"""A corner first: what is done next, by what is felt."""

from math import cos, pi, radians, sin

import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy import ControllerKind, Decision, Observation
from palpate.core.tasks.insertion_6dof import CornerFirst, SpatialOptions
from palpate.core.tasks.insertion_6dof.corner import Corner

SQUARE = SpatialOptions(corners=4.0, corner_mm=20.0)
NONE = (0.0, 0.0, 0.0)


def seen(force=NONE, torque=NONE, turn=NONE, depth_m=0.0):
    return Observation(0, NONE, NONE, force, torque, 0, turn, depth_m)


def spatial(decision):
    return decision.action.spatial


def tilted(policy, number=0, force=NONE, depth_m=0.0):
    """Decisions of a lean whose actions are done as asked; the next one is a push."""
    at, turn, decisions = np.zeros(2), np.zeros(3), list[Decision]()
    while not decisions or spatial(decisions[-1]).controller is ControllerKind.LIFT:
        place, turned = (*at.tolist(), 0.0), (turn[0], turn[1], turn[2])
        decisions.append(policy.choose(Observation(0, place, place, force, NONE, number, turned, depth_m)))
        at, turn = at + decisions[-1].action.displacement_m, turn + spatial(decisions[-1]).turn_rad
        force = NONE
    return decisions[:-1]


def cornered(pushes, options=SQUARE):
    """One that leans already, and has pushed so often without a wall."""
    policy = CornerFirst(options)
    policy.begin_trial(0, np.random.default_rng(0))
    tilted(policy)
    for _ in range(pushes - 1):
        policy.choose(seen())
    return policy


def test_a_corner_is_leaned_down_inside_its_place():
    policy = CornerFirst(SQUARE)
    policy.begin_trial(0, np.random.default_rng(0))
    tilt = tilted(policy)
    place = np.sum([each.action.displacement_m for each in tilt], axis=0)
    turn = np.sum([spatial(each).turn_rad for each in tilt], axis=0)
    assert place == pytest.approx([-6.5e-3 * cos(pi / 4)] * 2)
    # The corner at 45 degrees goes down: z into the plate is omega x r.
    down = np.cross(turn, (1.0, 1.0, 0.0))[2]
    assert (down > 0.0, np.linalg.norm(turn)) == (True, pytest.approx(radians(5.0)))
    # It clears the plate by 0.4 mm.
    assert spatial(tilt[0]).rise_m == pytest.approx(20e-3 * sin(radians(5.0)) + 0.4e-3)


@pytest.mark.parametrize("corners", [3.0, 4.0, 6.0])
def test_heights_and_ways_follow_the_part(corners):
    """Twice the part at the same lean: twice the heights."""
    small = Corner(SpatialOptions(corners=corners, corner_mm=15.0, inside_mm=5.0))
    large = Corner(SpatialOptions(corners=corners, corner_mm=30.0, inside_mm=10.0))
    assert (large.height_m, large.down_m) == (2.0 * small.height_m, 2.0 * small.down_m)
    tilt = (0.06, -0.06, 0.0)
    for depth_m in (-1e-3, 0.0, 1e-3):
        for one, other in (
            (small.facts(seen(NONE, NONE, tilt, depth_m)), large.facts(seen(NONE, NONE, tilt, 2.0 * depth_m))),
            (small.facts(seen(turn=NONE, depth_m=depth_m)), large.facts(seen(turn=NONE, depth_m=2.0 * depth_m))),
        ):
            assert other == pytest.approx(one)
    # A torque over the lever of the push.
    turned = small.facts(seen((-3.0, -3.0, 0.0), (0.0, 0.0, 6e-3), tilt))
    assert large.facts(seen((-3.0, -3.0, 0.0), (0.0, 0.0, 12e-3), tilt))[4] == pytest.approx(turned[4])
    assert large.pushing(seen(turn=tilt), 0.0).rise_m == pytest.approx(2.0 * small.pushing(seen(turn=tilt), 0.0).rise_m)


def test_it_stands_up_once_both_walls_carry_deep_enough_and_nothing_turns_the_tool():
    tilted, walls = (0.06, -0.06, 0.0), (-3.0, -3.0, -4.0)
    policy = cornered(2)
    for torque in ((0.0, 0.0, 0.03), NONE):
        pushing = spatial(policy.choose(seen(walls, torque, tilted, depth_m=1.5e-3)))
        assert (pushing.controller, pushing.turn_rad) == (ControllerKind.PUSH, NONE)
        assert pushing.push_N == pytest.approx((3.0, 3.0))
    standing = spatial(policy.choose(seen(walls, NONE, tilted, depth_m=1.5e-3)))
    assert (standing.controller, standing.turn_rad[0] < 0.0 < standing.turn_rad[1]) == (ControllerKind.PUSH, True)
    assert standing.pivot_m == pytest.approx((20e-3 * cos(pi / 4),) * 2)
    assert spatial(policy.choose(seen(walls, depth_m=1.5e-3))).controller is ControllerKind.INSERT
    # It came to nothing: out, and then the next corner.
    assert spatial(policy.choose(seen(depth_m=1e-3))).controller is ControllerKind.WITHDRAW
    decision = policy.choose(seen(depth_m=-1e-3))
    assert (spatial(decision).controller, decision.grounds) == (ControllerKind.LIFT, (1.0,))


def test_a_tool_that_does_not_come_out_is_inserted_again():
    policy, walls, deep_m = cornered(2), (-3.0, -3.0, -4.0), 5e-3
    for tilt in (0.06, 0.06):
        policy.choose(seen(walls, NONE, (tilt, -tilt, 0.0), depth_m=1.5e-3))
    controllers = [
        spatial(policy.choose(seen(walls, NONE, (0.008, 0.0, 0.0), depth_m=deep_m))).controller for _ in range(24)
    ]
    assert (
        controllers
        == [ControllerKind.INSERT]
        + [ControllerKind.WITHDRAW] * 20
        + [ControllerKind.INSERT]
        + [ControllerKind.WITHDRAW] * 2
    )


def test_a_wedged_corner_is_driven_in_yaw_to_both_sides_and_then_stands_up():
    policy, tilted = cornered(1), (0.06, -0.06, -0.02)
    message = [spatial(policy.choose(seen((-3.0, -3.0, -4.0), NONE, tilted, depth_m=-4e-4))) for _ in range(17)]
    # The torque of friction, times how the tool complies, for a tenth of a second.
    assert [round(each.turn_rad[2] * 1e3) for each in message] == [0] + [-20] * 7 + [20] * 7 + [0, 0]
    assert np.hypot(*message[1].push_N) == pytest.approx(2.0 * 3.0 * cos(pi / 4) / 3.0)
    assert (message[-1].controller, message[-1].turn_rad[0] < 0.0, message[-1].push_N[0] > 0.0) == (
        ControllerKind.PUSH,
        True,
        True,
    )


@pytest.mark.parametrize(
    ("walls", "depth_m", "pushes"), [(NONE, 0.0, 43), ((-3.0, 3.0, 0.0), 0.0, 43), (NONE, -1.7e-3, 3)]
)
def test_where_no_corner_is_found_it_gives_up(walls, depth_m, pushes):
    policy = cornered(1)
    controllers = [
        spatial(policy.choose(seen(walls, turn=(0.06, -0.06, 0.0), depth_m=depth_m))).controller for _ in range(44)
    ]
    # The push that ended the lean counts.
    assert controllers.index(ControllerKind.WITHDRAW) == pushes - 1


def test_a_flat_leads_as_a_corner_does_let_down_no_deeper_than_asked_and_again_aside():
    policy = CornerFirst(SpatialOptions(flat_deg=37.5, corner_mm=11.5, tilt_deg=7.0, inside_mm=7.0, down_share=0.75))
    policy.begin_trial(0, np.random.default_rng(0))
    places = []
    for _ in range(3):
        tilt = tilted(policy, depth_m=-4e-3)
        places.append(np.sum([each.action.displacement_m for each in tilt], axis=0) * 1e3)
        assert np.sum([spatial(each).turn_rad for each in tilt], axis=0) == pytest.approx((0.0, -radians(7.0), 0.0))
        walls, turn, held = (-4.8, 0.0, -1.0), (0.0, -radians(7.0), 0.0), -0.4e-3
        pushing = [policy.choose(seen(walls, NONE, turn, held)) for _ in range(2)]
        # Three quarters of the 1.4 mm by which the flat lies below the tip; 0.55 of that once the tool stands up.
        assert [spatial(each).rise_m * 1e3 for each in pushing] == pytest.approx([0.350, 0.544], abs=1e-3)
        assert spatial(pushing[0]).push_N == pytest.approx((4.76, 0.0), abs=0.01)
        assert [each.action.name for each in pushing] == ["push", "stand"]
        assert [policy.choose(seen()).action.name for _ in range(2)] == ["withdraw", "withdraw"]
    assert places == [pytest.approx((-7.0, aside_mm)) for aside_mm in (0.0, -1.75, 1.75)]


@pytest.mark.parametrize(
    ("options", "named"), [({}, r"task\.options\.corners"), ({"corners": 4.0, "flat_deg": 30.0}, "flat_deg")]
)
def test_a_peg_with_neither_corners_nor_a_flat_is_refused_and_so_is_one_with_both(options, named):
    with pytest.raises(ConfigurationError, match=named):
        CornerFirst(SpatialOptions(**options))
