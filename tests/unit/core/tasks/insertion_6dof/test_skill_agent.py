"""A policy of skills: it chooses when one is over, and learns of the whole of it."""

from math import radians

import numpy as np
import pytest

from palpate.core.perception import FACTS, LastAction, Perception, Situations, TaskFacts
from palpate.core.policy import Law, Observation, TimePenalty
from palpate.core.tasks.insertion_6dof import SpatialOptions
from palpate.core.tasks.insertion_6dof.skills import KINDS, SKILLS, SkillAgent, Skills
from tests.unit.core.policy.bench import Diary

NONE = (0.0, 0.0, 0.0)
PLACE = (-6.5e-3 * 0.5**0.5, -6.5e-3 * 0.5**0.5, 0.0)
LEAN, PUSH, INSERT = (next(n for n, skill in enumerate(SKILLS) if skill.name.startswith(kind))
                      for kind in ("lean", "push", "insert"))  # fmt: skip


def agent_with(*indices):
    perception = Perception(TaskFacts(FACTS), Situations(), LastAction(Situations.symbols, KINDS))
    diary, skills = Diary(indices, SKILLS), Skills(SpatialOptions(corners=4.0, corner_mm=20.0), 11e-3)
    agent = SkillAgent(perception, diary, TimePenalty(), 0.01, skills)
    agent.begin(0, np.random.default_rng(0))
    return agent, diary


def act(agent, tick, turn_rad=NONE, depth_m=0.0, at=NONE):
    agent.perceive(tick, at, at, NONE, NONE, turn_rad, NONE, depth_m)
    decision = agent.choose()
    assert decision.action.spatial is not None
    return f"{decision.action.name}: {decision.action.spatial.law.value}"


def test_the_policy_is_asked_when_a_skill_is_over_and_learns_what_all_of_it_cost():
    agent, diary = agent_with(*[LEAN] * 4, PUSH)
    # The lean takes four actions of ten ticks; the push then stands on the plate and is over after three.
    lean = radians(5.0) * 0.5**0.5
    done = [act(agent, 10 * n) for n in range(4)]
    done += [act(agent, 40 + 10 * n, turn_rad=(lean, -lean, 0.0), depth_m=-1.7e-3, at=PLACE) for n in range(3)]
    assert done == ["lean 1: lift"] * 4 + ["push 0.67: push"] * 3
    asked = [entry for entry in diary.entries if isinstance(entry, Observation)]
    states = [Perception(TaskFacts(FACTS), Situations(), LastAction(Situations.symbols, KINDS)).states[one.state]
              for one in asked]  # fmt: skip
    assert states == ["upright on the plate at first", "leaning on the plate after lean"]
    (learned,) = diary.learned
    assert (learned.action_index, learned.next_state) == (LEAN, asked[1].state)
    assert learned.reinforcement == pytest.approx(-10.0 * 0.01 * 40)
    assert [record.index for record in agent.decisions] == [LEAN] * 4 + [PUSH] * 3


def test_an_insertion_that_got_stuck_costs_the_time_that_it_took():
    agent, diary = agent_with(INSERT)
    act(agent, 5)
    act(agent, 285, depth_m=-1e-3)
    assert diary.learned[0].reinforcement == pytest.approx(-10.0 * 0.01 * 280)


def test_actions_of_no_set_are_done_as_they_are_and_taught_to_nobody():
    agent, diary = agent_with(None)
    agent.perceive(0, NONE, NONE, NONE, NONE, NONE, NONE, 0.0)
    decision = agent.choose()
    assert (decision.action.name, decision.action.displacement_m) == ("far", (1.0, 0.0))
    agent.perceive(10, NONE, NONE, NONE, NONE, NONE, NONE, 0.0)
    agent.gave_up(NONE, NONE, NONE)
    assert not diary.learned


def test_a_trial_begins_with_what_the_peg_is_set_up_with():
    agent, _ = agent_with(PUSH, INSERT)
    act(agent, 0)
    agent.begin(1, np.random.default_rng(0))
    stand = next(skill for skill in SKILLS if skill.name.startswith("stand"))
    agent._skills.begin(stand, agent.perceive(0, NONE, NONE, NONE, NONE, NONE, NONE, 0.0))
    spatial = agent._skills.step(agent.perceive(0, NONE, NONE, NONE, NONE, NONE, NONE, 0.0))[1]
    assert (spatial.law, np.hypot(*spatial.push_N)) == (Law.PUSH, pytest.approx(2.0 * 3.0 * np.cos(np.pi / 4)))
