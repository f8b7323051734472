"""Skills: what each does, and when it is over."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from palpate.core.perception import FACTS, LastAction, Perception, Situations, TaskFacts
from palpate.core.policy import ControllerKind, Observation, TimePenalty
from palpate.core.tasks.insertion_6dof import SpatialOptions
from palpate.core.tasks.insertion_6dof.option_agent import KINDS, OPTIONS, OptionAgent, OptionRunner, by_rule, can_start
from tests.unit.core.policy.bench import Diary

SQUARE = SpatialOptions(corners=4.0, corner_mm=20.0)
NONE = (0.0, 0.0, 0.0)
LEANED = (0.06, -0.06, 0.0)
WALLS = (-3.0, -3.0, -4.0)
NAMED = {option.name: option for option in OPTIONS}


def seen(force=NONE, torque=NONE, turn=NONE, depth_m=0.0, at=NONE):
    return Observation(0, at, at, force, torque, 0, turn, depth_m)


def begun(name, observation, options=SQUARE):
    skills = OptionRunner(options, 11e-3)
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
        if skills.terminated(observation):
            return number
    raise AssertionError("it never ends")


@pytest.mark.parametrize(
    ("name", "observation", "actions"),
    [
        # What is held in the hole is drawn, not lifted, however long that takes.
        ("tilt 1", seen(turn=LEANED, depth_m=1e-3), 43),
        ("push 1", seen(WALLS, NONE, LEANED, 1e-3), 2),
        ("push 1", seen(WALLS, (0.0, 0.0, 0.03), LEANED, -1.5e-3), 3),
        ("push 1", seen(WALLS, (0.0, 0.0, 0.03), LEANED, -1e-3), 43),
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


def test_a_tool_that_is_far_out_is_pushed_no_further():
    for at, pushed in (((6e-3, 0.0, 0.0), True), ((9e-3, 9e-3, 0.0), False), ((-9e-3, -9e-3, 0.0), True)):
        spatial = begun("push 1", seen()).step(seen(at=at))[1]
        assert (spatial.controller, np.hypot(*spatial.push_N) > 0.0) == (ControllerKind.PUSH, pushed)


def test_the_rule_takes_one_kind_of_skill_in_each_state_and_only_where_that_may_begin():
    states = LastAction(Situations.symbols, KINDS).states
    taken = {state: {kind for kind in KINDS if by_rule(kind, state)} for state in states}
    assert {len(kinds) for kinds in taken.values()} == {1}
    # No tool is tilted at first or stands in the hole after less than a stand.
    assert all(can_start(kind, state) for state, (kind,) in taken.items() if "first" not in state)
    said = ["upright on the plate at first", "corner turning after tilt", "tilted on the plate after push",
            "corner wedged after push", "corner wedged after drive", "corner seated after push",
            "upright in the hole after stand", "upright in the hole after insert"]  # fmt: skip
    assert [*(kind for state in said for kind in taken[state])] == [
        "tilt", "push", "tilt", "drive", "tilt", "stand", "insert", "withdraw",
    ]  # fmt: skip


def test_skills_begin_only_where_they_can_come_to_something():
    begins = {
        kind: [one.split()[0] for one in Situations.symbols if can_start(kind, f"{one} after push")] for kind in KINDS
    }
    assert (begins["insert"], begins["drive"]) == (["upright"], ["corner"] * 3)
    assert begins["push"] == begins["stand"] == ["tilted"] * 2 + ["corner"] * 3
    assert len(begins["tilt"]) == len(Situations.symbols)


NONE = (0.0, 0.0, 0.0)
PLACE = (-6.5e-3 * 0.5**0.5, -6.5e-3 * 0.5**0.5, 0.0)
TILT, PUSH, INSERT = (next(n for n, option in enumerate(OPTIONS) if option.name.startswith(kind))
                      for kind in ("tilt", "push", "insert"))  # fmt: skip


def agent_with(*indices):
    perception = Perception(TaskFacts(FACTS), Situations(), LastAction(Situations.symbols, KINDS))
    diary, skills = Diary(indices, OPTIONS), OptionRunner(SpatialOptions(corners=4.0, corner_mm=20.0), 11e-3)
    agent = OptionAgent(perception, diary, TimePenalty(), 0.01, skills)
    agent.begin(0, np.random.default_rng(0))
    return agent, diary


def act(agent, tick, turn_rad=NONE, depth_m=0.0, at=NONE):
    agent.perceive(tick, at, at, NONE, NONE, turn_rad, depth_m)
    decision = agent.choose()
    return f"{decision.action.name}: {decision.action.spatial.controller.value}"


def test_the_policy_is_asked_when_a_skill_is_over_and_learns_what_all_of_it_cost():
    agent, diary = agent_with(*[TILT] * 4, PUSH)
    # The lean takes four actions of ten ticks; the push then stands on the plate and is over after three.
    tilt = radians(5.0) * 0.5**0.5
    done = [act(agent, 10 * n) for n in range(4)]
    done += [act(agent, 40 + 10 * n, turn_rad=(tilt, -tilt, 0.0), depth_m=-1.7e-3, at=PLACE) for n in range(3)]
    assert done == ["tilt 1: lift"] * 4 + ["push 0.67: push"] * 3
    requested = [entry for entry in diary.entries if isinstance(entry, Observation)]
    states = [Perception(TaskFacts(FACTS), Situations(), LastAction(Situations.symbols, KINDS)).states[one.state]
              for one in requested]  # fmt: skip
    assert states == ["upright on the plate at first", "tilted on the plate after tilt"]
    (learned,) = diary.learned
    assert (learned.action_index, learned.next_state) == (TILT, requested[1].state)
    assert learned.reinforcement == pytest.approx(-10.0 * 0.01 * 40)
    assert [record.index for record in agent.decisions] == [TILT] * 4 + [PUSH] * 3


def test_actions_of_no_set_are_done_as_they_are_and_taught_to_nobody():
    agent, diary = agent_with(None)
    agent.perceive(0, NONE, NONE, NONE, NONE, NONE, 0.0)
    decision = agent.choose()
    assert (decision.action.name, decision.action.displacement_m) == ("far", (1.0, 0.0))
    agent.perceive(10, NONE, NONE, NONE, NONE, NONE, 0.0)
    agent.gave_up(NONE, NONE, NONE)
    assert not diary.learned
