"""Skills: what each does, and when it is over."""

from dataclasses import replace
from math import cos, pi, radians

import numpy as np
import pytest

from palpate.core.perception import FACTS, LastAction, Situations
from palpate.core.policy import Law, Observation
from palpate.core.tasks.insertion_6dof import SpatialOptions
from palpate.core.tasks.insertion_6dof.skills import KINDS, SKILLS, Skills, by_rule, may_begin

SQUARE = SpatialOptions(corners=4.0, corner_mm=20.0)
NONE = (0.0, 0.0, 0.0)
LEANED = (0.06, -0.06, 0.0)
WALLS = (-3.0, -3.0, -4.0)
NAMED = {skill.name: skill for skill in SKILLS}


def seen(force=NONE, torque=NONE, turn=NONE, depth_m=0.0, at=NONE):
    return Observation(0, at, at, force, torque, 0, turn, torque, depth_m)


def begun(name, observation, options=SQUARE):
    skills = Skills(options, 11e-3)
    skills.begin_trial()
    skills.begin(NAMED[name], observation)
    return skills


def moved(observation, displacement_m, turn_rad):
    """What is seen after an action that is done as asked."""
    (x, y, z), turn = observation.reference_m, np.add(observation.turn_rad, turn_rad)
    at = x + displacement_m[0], y + displacement_m[1], z
    return replace(observation, position_m=at, reference_m=at, turn_rad=(turn[0], turn[1], turn[2]))


def length(skills, observation, *, moves=False):
    """Actions until the skill is over, while what is felt stays as it is."""
    for number in range(1, 100):
        displacement_m, spatial = skills.step(observation)
        if moves:
            observation = moved(observation, displacement_m, spatial.turn_rad)
        if skills.over(observation):
            return number
    raise AssertionError("it never ends")


@pytest.mark.parametrize(
    ("name", "observation", "actions"),
    [
        # What is held in the hole is drawn, not lifted, however long that takes.
        ("lean 1", seen(turn=LEANED, depth_m=1e-3), 43),
        ("push 1", seen(WALLS, NONE, LEANED, 1e-3), 2),
        ("push 1", seen(turn=LEANED, depth_m=-1.7e-3), 3),
        ("push 1", seen(WALLS, (0.0, 0.0, 0.03), LEANED, 1e-3), 43),
        # Pushed past the place where the corner came down.
        ("push 1", seen(WALLS, (0.0, 0.0, 0.03), LEANED, at=(5e-3, 5e-3, 0.0)), 1),
        # A corner that is let down to a height hangs where it is 0.4 mm higher, and is in where it is 0.1.
        ("drive", seen(WALLS, NONE, LEANED, -4e-4), 14),
        ("drive", seen(WALLS, NONE, LEANED, -1e-4), 2),
        ("drive", seen(WALLS, NONE, LEANED, 1e-3), 2),
        ("stand 1", seen(), 1),
        ("stand 1.6", seen(turn=LEANED), 43),
        ("insert", seen(), 1),
        ("withdraw", seen(turn=LEANED, depth_m=1e-3), 43),
        ("withdraw", seen(depth_m=-1e-3), 1),
    ],
)
def test_each_skill_has_an_end(name, observation, actions):
    assert length(begun(name, observation), observation) == actions


def test_a_larger_lean_takes_no_less():
    # By 2 degrees an action, and 6.5 mm at 1.8.
    assert length(begun("lean 1", seen()), seen(), moves=True) == 4
    far = replace(SQUARE, lean_deg=8.0, most_lean_deg=10.0)
    assert length(begun("lean 1.2", seen(), far), seen(), moves=True) == 5


def test_leans_and_pushes_are_of_the_size_that_was_chosen_and_go_on_to_the_next_corner():
    skills, headings = begun("lean 1", seen()), []
    for name, deg in (("lean 1", 5.0), ("lean 1.2", 6.0)):
        at = seen()
        skills.begin(NAMED[name], at)
        for _ in range(20):
            displacement_m, spatial = skills.step(at)
            at = moved(at, displacement_m, spatial.turn_rad)
            if skills.over(at):
                break
        headings.append(np.sign(at.turn_rad[:2]).tolist())
        assert np.hypot(*at.turn_rad[:2]) == pytest.approx(radians(deg))
    assert headings[0] != headings[1]
    for name, push_N in (("push 0.67", 2.01), ("push 1.33", 3.99)):
        skills.begin(NAMED[name], seen())
        # On each of the two walls.
        assert np.hypot(*skills.step(seen())[1].push_N) == pytest.approx(2.0 * push_N * cos(pi / 4))


def test_a_drive_turns_to_and_fro_until_the_corner_is_caught():
    wedged = seen(WALLS, NONE, (0.06, -0.06, -0.01), -4e-4)
    skills, yaws = begun("drive", wedged), []
    for _ in range(14):
        yaws.append(skills.step(wedged)[1].turn_rad[2])
        skills.over(wedged)
    assert np.sign(yaws).tolist() == [-1.0] * 7 + [1.0] * 7
    assert skills.step(seen(WALLS, NONE, LEANED, 1e-3))[1].turn_rad[2] == 0.0


def test_a_tool_that_is_far_out_is_pushed_no_further():
    for at, pushed in (((6e-3, 0.0, 0.0), True), ((9e-3, 9e-3, 0.0), False), ((-9e-3, -9e-3, 0.0), True)):
        spatial = begun("push 1", seen()).step(seen(at=at))[1]
        assert (spatial.law, np.hypot(*spatial.push_N) > 0.0) == (Law.PUSH, pushed)


def test_facts_have_the_depth_of_the_lowest_corner_and_the_lesser_wall():
    facts = dict(zip(FACTS, begun("push 1", seen()).facts(seen(WALLS, (0.0, 0.0, 0.01), LEANED)), strict=True))
    # Over three tenths of what a corner is let down, half the push, and a fifth of the push at the corner.
    down_m = 0.9 * 20e-3 * np.sin(radians(5.0))
    assert facts["lean"] == pytest.approx(0.06 * 2**0.5 / radians(5.0))
    assert facts["corner_depth"] == pytest.approx(20e-3 * np.sin(0.06 * 2**0.5) / (0.3 * down_m))
    assert (facts["wall_force"], facts["yaw_torque"]) == (pytest.approx(2.0), pytest.approx(0.01 / 0.012))


@pytest.mark.parametrize(("depth_m", "situation"), [(-4e-4, "corner wedged"), (0.0, "corner caught")])
def test_a_corner_is_in_where_it_is_as_deep_as_it_is_let_down(depth_m, situation):
    skills = Skills(SQUARE, 11e-3)
    skills.begin_trial()
    facts = skills.facts(seen(WALLS, NONE, LEANED, depth_m))
    assert Situations.symbols[Situations().symbol(facts)] == situation


def test_the_rule_takes_one_kind_of_skill_in_each_state_and_only_where_that_may_begin():
    states = LastAction(Situations.symbols, KINDS).states
    taken = {state: {kind for kind in KINDS if by_rule(kind, state)} for state in states}
    assert {len(kinds) for kinds in taken.values()} == {1}
    # No tool leans at first or stands in the hole after less than a stand.
    assert all(may_begin(kind, state) for state, (kind,) in taken.items() if "first" not in state)
    said = ["upright on the plate at first", "corner turning after lean", "leaning on the plate after push",
            "corner wedged after push", "corner wedged after drive", "corner caught after push",
            "upright in the hole after stand", "upright in the hole after insert"]  # fmt: skip
    assert [*(kind for state in said for kind in taken[state])] == [
        "lean", "push", "lean", "drive", "lean", "stand", "insert", "withdraw",
    ]  # fmt: skip


def test_skills_begin_only_where_they_can_come_to_something():
    begins = {
        kind: [one.split()[0] for one in Situations.symbols if may_begin(kind, f"{one} after push")] for kind in KINDS
    }
    assert (begins["insert"], begins["drive"]) == (["upright"], ["corner"] * 3)
    assert begins["push"] == begins["stand"] == ["leaning"] * 2 + ["corner"] * 3
    assert len(begins["lean"]) == len(Situations.symbols)
