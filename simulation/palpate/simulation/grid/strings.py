"""Strings of symbols from random walks (paper, section 4)."""

from __future__ import annotations

from palpate.core.automata import Strings
from palpate.core.errors import require_whole
from palpate.core.insertion import Purpose, generator
from palpate.core.perception import IdentityState
from palpate.core.policy import RandomWalkPolicy
from palpate.simulation.grid.maps import GridMap, grid_actions
from palpate.simulation.grid.trial import STEP_LIMIT, run_trial


def walk_strings(grid: GridMap, count: int, seed: int, longest: int = STEP_LIMIT) -> Strings:
    """Readings of random walks that ended at the goal, the start's first; the goal itself has none.

    The walks are trials 0, 1, 2, ... of :func:`~palpate.simulation.grid.trial.run_trial` under a random policy; those
    that have not reached the goal after ``longest`` steps are left out, and the next trial takes their place. Files of
    such strings are those of :mod:`palpate.core.automata.strings`.

    Args:
        grid: The map.
        count: How many strings, from 1.
        seed: Gives the walks, which have nothing in common with learning runs of the same seed.
        longest: Most symbols of a string, which is the most steps of a walk.

    Raises:
        ConfigurationError: A number is out of its range, or the walks show a single symbol only.
    """
    require_whole("walks", count, 1, 10_000_000)
    require_whole("longest", longest, 1, 10_000_000)
    identifier, policy = IdentityState(grid.symbols), RandomWalkPolicy(grid_actions())
    own_seed = int(generator(seed, Purpose.WALKS).integers(2**63))
    words: list[tuple[int, ...]] = []
    trial = 0
    while len(words) < count:
        walk = run_trial(grid, identifier, policy, own_seed, trial, step_limit=longest)
        trial += 1
        if walk.reached:
            words.append(walk.symbols)
    return Strings(grid.symbols, tuple(words))
