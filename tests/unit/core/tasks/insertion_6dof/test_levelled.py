"""The levelling touch, over a plate that gives the torque of a spring up to that of an edge."""

from math import copysign, hypot

import numpy as np
import pytest

from palpate.core.policy import Action, Decision, FixedPolicy, Law, Observation, Spatial
from palpate.core.tasks.insertion_6dof import Levelled
from palpate.core.trial import TaskConfig

LEVEL_RAD = (0.012, -0.005)
EDGE_NM = 0.07
STIFFNESS_NM_PER_RAD = 50.0


class Search(FixedPolicy):
    """Keeps what it sees."""

    def __init__(self) -> None:
        super().__init__()
        self.seen: list[Observation] = []

    def choose(self, observation: Observation) -> Decision:
        self.seen.append(observation)
        return Decision(Action("search", (0.0, 0.0), Spatial()), None, "search")


def carried_out(actions: int, level_rad: tuple[float, float] = LEVEL_RAD) -> tuple[list[Action], Search]:
    """So many actions in free space and on the plate; those of the levelling, and what the search saw."""
    search = Search()
    policy = Levelled(TaskConfig(), 36e-3, search)
    policy.begin_trial(0, np.random.default_rng(0))
    x_m, turn, height_m, done = 0.0, (0.0, 0.0), 0.0, []
    for number in range(actions):
        on_plate = height_m <= 0.0
        apart = [STIFFNESS_NM_PER_RAD * (level - each) for level, each in zip(level_rad, turn, strict=True)]
        tx, ty = (copysign(min(abs(each), EDGE_NM), each) if on_plate else 0.0 for each in apart)
        at, torque, force = (x_m, 0.0, height_m), (tx, ty, 0.0), (0.0, 0.0, -4.9 if on_plate else 0.0)
        seen = Observation(0, at, at, force, torque, number, (*turn, 0.0), live_torque_Nm=torque)
        action = policy.choose(seen).action
        done += [action] * (action.name != "search")
        spatial = action.spatial
        assert spatial is not None
        x_m += action.displacement_m[0]
        turn = turn[0] + spatial.turn_rad[0], turn[1] + spatial.turn_rad[1]
        height_m = height_m + spatial.rise_m if spatial.law is Law.LIFT else height_m - 1e-3
    return done, search


def test_it_levels_the_tool_beside_and_comes_back() -> None:
    done, search = carried_out(80)
    names = [action.name for action in done]
    assert list(dict.fromkeys(names)) == ["rise", "out", "down", "level", "up", "back", "on_plate"]
    out_mm = [1e3 * action.displacement_m[0] for action in done if action.name == "out"]
    assert sum(out_mm) == pytest.approx(36.0)
    assert max(out_mm) <= TaskConfig().travel_speed_mm_s * 0.1 + 1e-9
    assert sum(action.displacement_m[0] for action in done) == pytest.approx(0.0, abs=1e-9)
    turns = np.sum([action.spatial.turn_rad for action in done if action.spatial is not None], axis=0)
    assert hypot(turns[0] - LEVEL_RAD[0], turns[1] - LEVEL_RAD[1]) < 0.3e-3
    assert names.count("level") < 15
    assert (search.seen[0].turn_rad, search.seen[0].action_number) == ((0.0, 0.0, 0.0), 0)
    assert [each.action_number for each in search.seen] == list(range(80 - len(done)))


def test_a_tool_that_never_comes_level_is_searched_with_all_the_same() -> None:
    done, search = carried_out(120, level_rad=(10.0, 0.0))
    assert [action.name for action in done].count("level") == 40
    assert search.seen
