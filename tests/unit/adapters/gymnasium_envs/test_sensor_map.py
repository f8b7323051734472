"""The grid worlds as environments: moves, ends and refusals."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from palpate.adapters.gymnasium_envs.episode import ActionRefusedError, NotRunningError
from palpate.adapters.gymnasium_envs.sensor_map import SensorMapEnv
from palpate.core.errors import ConfigurationError

RIGHT, LEFT = 0, 4


@pytest.fixture
def corridor(tmp_path: Any) -> str:
    path = tmp_path / "corridor.txt"
    path.write_text("ABB.\n", encoding="utf-8")
    return str(path)


def from_cell(env: SensorMapEnv, column: int) -> None:
    """Begin an episode in that column."""
    for trial in range(100):
        _, info = env.reset(seed=0, options={"trial": trial})
        if info["column"] == column:
            return
    raise LookupError(column)


def after(env: SensorMapEnv, moves: Iterable[int]) -> list[tuple[Any, ...]]:
    return [env.step(move) for move in moves]


def test_moves_lead_where_the_map_says_and_the_agent_reads_its_cell_only(corridor: str) -> None:
    env = SensorMapEnv(map=corridor)
    assert (env.observation_space.n, env.action_space.n) == (2, 8)
    from_cell(env, 0)
    seen = after(env, [LEFT, RIGHT, RIGHT, RIGHT])
    assert [int(step[0]) for step in seen] == [0, 1, 1, 1]  # at the goal nothing is read
    assert [step[1] for step in seen] == [-1.0] * 4
    assert [step[2:4] for step in seen] == [(False, False)] * 3 + [(True, False)]
    assert [(s[4]["column"], s[4]["distance"], s[4]["symbol"]) for s in seen] == [
        (0, 3, "A"), (1, 2, "B"), (2, 1, "B"), (3, 0, "B"),
    ]  # fmt: skip
    assert seen[-1][4]["is_success"]


@pytest.mark.parametrize("action", [8, -1, 0.5, np.nan, None, "right"])
def test_a_refused_action_moves_nothing(corridor: str, action: Any) -> None:
    env = SensorMapEnv(map=corridor)
    from_cell(env, 1)
    with pytest.raises(ActionRefusedError, match="from 0 to 7"):
        env.step(action)
    assert env.step(LEFT)[4] | {"seed": 0, "trial": 0} == {
        "seed": 0, "trial": 0, "steps": 1, "is_success": False, "symbol": "A", "state": "A",
        "column": 0, "row": 0, "distance": 3,
    }  # fmt: skip


def test_a_step_needs_an_episode_that_runs(corridor: str) -> None:
    env = SensorMapEnv(map=corridor)
    with pytest.raises(NotRunningError, match="call reset"):
        env.step(RIGHT)
    from_cell(env, 2)
    assert env.step(RIGHT)[2]
    with pytest.raises(NotRunningError, match="after an episode has ended"):
        env.step(RIGHT)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"map": "3"}, "map = '3' is refused: one of 1, 2, twin, eight regions"),
        ({"map": "AB/C.E/BDF"}, "grid.map = 'AB/C.E/BDF' is refused"),
        ({"map": 1}, "map = 1 is refused: a text"),
        ({"size": 8}, "grid.size = 8 is refused: an odd number"),
        ({"state": "symbol"}, "state = 'symbol' is refused"),
        ({"state": None}, "state = None is refused: a text"),
        ({"step_limit": 0}, "step_limit = 0 is refused"),
        ({"render_mode": "human"}, "render_mode = 'human' is refused: None"),
        ({"maps": "1"}, "maps = '1' is refused: no such argument of palpate/SensorMap-v0; there are map, size"),
    ],
)
def test_what_there_is_not_is_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        SensorMapEnv(**arguments)
    assert str(caught.value).startswith(message)
