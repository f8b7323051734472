"""Pictures of an episode show the cell as it stands, and change nothing in it."""

from itertools import pairwise

import numpy as np
import pytest

from palpate.adapters.gymnasium_envs.peg_insertion import PegInsertionEnv
from palpate.adapters.gymnasium_envs.picture import RunningCell
from tests.support.graphics import require_graphics

EAST, WEST = 0, 4


def walk(env, *, look):
    seen, pictures = [env.reset(seed=2)[0].tobytes()], []
    for action in (EAST, EAST, WEST, EAST):
        if look:
            pictures.append(env.render())
        seen.append(env.step(action)[0].tobytes())
    return seen, pictures


def test_the_cell_that_is_drawn_stands_where_the_simulated_one_does():
    env = PegInsertionEnv(scenario="blind")
    env.reset(seed=2)
    digest = env.cell.model_sha256()
    drawn = RunningCell(env._episodes.config, env.cell)
    drawn.model.geom_rgba[:] = 0.5
    assert env.cell.model_sha256() == digest  # the model of the physics is another
    for seed in (2, 3):
        _, info = env.reset(seed=seed)
        env.step(EAST)
        drawn.follow()
        # The site is where it was a physics step ago.
        assert drawn.tip_m == pytest.approx(env.cell.data.site("tip").xpos, abs=2e-5)
        assert drawn.mouth_m == pytest.approx(env.cell.model.body_pos[env.cell.model.body("plate").id])
        assert np.hypot(*info["true_hole_m"][:2]) > 1e-4
    env.close()


def test_pictures_show_how_the_peg_moves_and_looking_changes_nothing():
    require_graphics()
    looked, unseen = (PegInsertionEnv(observations="raw", render_mode=mode) for mode in ("rgb_array", None))
    seen, pictures = walk(looked, look=True)
    assert seen == walk(unseen, look=False)[0]
    assert {(p.shape, p.dtype.str) for p in pictures} == {((480, 640, 3), "|u1")}
    # Some hundred pixels at the edge of the peg are others, most are not.
    differing = [int((a != b).any(axis=2).sum()) for a, b in pairwise(pictures)]
    assert all(100 < count < 100_000 for count in differing)
    looked.close()
    looked.close()
    assert looked.render() is None
    assert unseen.render() is None
    unseen.close()
