"""Pictures of an episode show the cell as it stands, and change nothing in it."""

from itertools import pairwise

from palpate.adapters.gymnasium_envs.peg_insertion import PegInsertionEnv
from tests.support.graphics import require_graphics

EAST, WEST = 0, 4


def walk(env, *, look):
    seen, pictures = [env.reset(seed=2)[0].tobytes()], []
    for action in (EAST, EAST, WEST, EAST):
        if look:
            pictures.append(env.render())
        seen.append(env.step(action)[0].tobytes())
    return seen, pictures


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
