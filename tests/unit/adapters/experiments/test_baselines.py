"""The strategies to compare with do what their names say."""

from dataclasses import replace
from math import cos, hypot, pi, radians, sin

import numpy as np
import pinocchio as pin
import pytest

from palpate.adapters.experiments.baselines import Oracle, OraclePose, Spiral, TorqueFollowing
from palpate.core.motion import orientation
from palpate.core.policy import Law, compass_actions
from tests.unit.adapters.samples import observation

ACTIONS = compass_actions(0.5e-3)
PITCH_M = 0.36e-3
STEP_M = 0.5e-3


def walk(policy, start_m, steps):
    """Where the tip is commanded to, action by action, (steps + 1, 2)."""
    places = [start_m]
    for k in range(steps):
        dx, dy = policy.choose(observation(*places[-1], action_number=k)).action.displacement_m
        places.append((places[-1][0] + dx, places[-1][1] + dy))
    return np.array(places)


def spiral():
    return Spiral("spiral-5", PITCH_M, STEP_M)


def test_the_oracle_goes_straight_to_the_hole_and_stays():
    hole = np.array([1e-3, -2e-3])
    places = walk(Oracle(lambda: (*hole, 0.0), STEP_M), (-1e-3, 1e-3), 12)
    lengths = np.hypot(*np.diff(places, axis=0).T)
    whole = int(hypot(2e-3, 3e-3) / STEP_M)
    assert lengths[:whole] == pytest.approx(STEP_M)
    assert lengths.sum() == pytest.approx(hypot(2e-3, 3e-3))
    assert places[-1] == pytest.approx(hole)
    off_line = (places - places[0]) @ (3.0, 2.0)  # normal to the line from start to hole
    assert off_line == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("index", range(8))
def test_the_torque_tells_the_heading_of_the_hole(index):
    # Beside the hole the plate supports the far side only. With the hole towards (hx, hy), the force (0, 0, -F)
    # acts at the lever -(hx, hy): torque = lever x force = F (hy, -hx), so the hole is at (-ty, tx).
    hx, hy = ACTIONS[index].displacement_m
    lever, force = np.array([-hx, -hy, 0.0]) * 20.0, np.array([0.0, 0.0, -5.0])
    tx, ty, tz = np.cross(lever, force)
    decision = TorqueFollowing(ACTIONS, 0.01).choose(observation(torque_Nm=(tx, ty, tz)))
    assert (decision.index, decision.action) == (index, ACTIONS[index])


def test_only_a_torque_below_the_threshold_is_left_to_chance():
    policy = TorqueFollowing(ACTIONS, 0.01)
    rng = np.random.default_rng(5)
    policy.begin_trial(0, rng)
    fresh = rng.bit_generator.state
    # Torque about the tool axis says nothing about the hole.
    quiet = observation(torque_Nm=(0.0, -0.0099, 5.0))
    assert {policy.choose(observation(torque_Nm=(0.0, -0.01, 0.0))).index for _ in range(50)} == {0}
    assert rng.bit_generator.state == fresh
    assert {policy.choose(quiet).index for _ in range(200)} == set(range(8))


def test_the_spiral_leaves_no_gap():
    # As fine as the tip really moves: along the chords.
    corners = walk(spiral(), (0.0, 0.0), 200)
    share = np.linspace(0.0, 1.0, 10, endpoint=False)[:, None, None]
    path = (corners[:-1] + share * np.diff(corners, axis=0)).reshape(-1, 2)
    rng = np.random.default_rng(0)
    radius, heading = 3e-3 * np.sqrt(rng.uniform(size=500)), rng.uniform(0.0, 2 * pi, 500)
    points = np.column_stack((radius * np.cos(heading), radius * np.sin(heading)))
    gaps = np.linalg.norm(points[:, None] - path, axis=2).min(axis=1)
    # Half a pitch, and what chords cut off the corners of the first turns.
    assert gaps.max() <= 0.62 * PITCH_M
    assert gaps[radius > 2 * PITCH_M].max() <= 0.54 * PITCH_M
    assert gaps.max() > 0.45 * PITCH_M  # or it would search more closely than it says


def test_the_spiral_goes_on_from_where_it_should_be():
    # At the border of the area a step is cut short; the spiral must not be bent by that.
    free = walk(spiral(), (0.0, 0.0), 11)
    policy = spiral()
    walk(policy, (0.0, 0.0), 10)
    held_m = (0.1e-3, 0.0)
    displacement = policy.choose(observation(*held_m, action_number=10)).action.displacement_m
    assert np.add(held_m, displacement) == pytest.approx(free[11])


@pytest.mark.parametrize("heading_deg", [-130.0, 20.0])
def test_the_oracle_pose_is_that_of_a_leaning_peg_in_line_with_the_hole(heading_deg):
    hole = np.array([0.012, -0.014, 0.08])
    policy = OraclePose(lambda: (1e-3, -2e-3, 0.0, *hole, heading_deg), 4e-3, 0.0, 2e-3, 0.035)
    place, turn, actions = np.zeros(2), np.zeros(3), []
    while not actions or actions[-1].spatial.law is Law.LIFT:
        seen = replace(observation(*place), turn_rad=tuple(turn), depth_m=-1e-3 if actions else 0.0)
        actions.append(policy.choose(seen).action)
        place, turn = place + actions[-1].displacement_m, turn + actions[-1].spatial.turn_rad
    # Three actions for a turn of 0.08 rad, one of them lifts; then down.
    assert [action.spatial.rise_m for action in actions] == [1e-3, 0.0, 0.0, 0.0]
    assert actions[-1].spatial.law is Law.INSERT
    assert place == pytest.approx([1e-3, -2e-3])
    c, s = cos(radians(heading_deg)), sin(radians(heading_deg))
    peg = np.array(orientation(tuple(turn))) @ pin.exp3(np.array([-4e-3 * s, 4e-3 * c, 0.0]))
    assert peg == pytest.approx(pin.exp3(hole), abs=1e-12)
