"""The filter against the sum over every path, and what it does with the impossible."""

from itertools import product

import numpy as np
import pytest

from palpate.core.policy.hmm import FinitePomdp
from palpate.core.policy.hmm.belief import StateBelief
from tests.unit.core.policy.hmm.worlds import random_pomdp


@pytest.mark.parametrize("seed", range(5))
def test_it_is_the_sum_over_all_paths(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world, symbols, actions = random_pomdp(rng), [0, 1, 1, 0], [1, 0, 1]
    belief = StateBelief(world, symbols[0])
    for action, symbol in zip(actions, symbols[1:], strict=True):
        belief.update(action, symbol)
    by_state = np.zeros(world.states)
    for path in product(range(world.states), repeat=4):
        share = world.start[path[0]] * world.emissions[path[0], symbols[0]]
        for time, action in enumerate(actions):
            share *= world.transitions[action, path[time], path[time + 1]]
            share *= world.emissions[path[time + 1], symbols[time + 1]]
        by_state[path[-1]] += share
    np.testing.assert_allclose(belief.probabilities, by_state / by_state.sum(), rtol=1e-9)


def test_after_an_impossible_reading_it_begins_anew_with_that_reading() -> None:
    stays = np.eye(2)[None]
    world = FinitePomdp(np.array([0.5, 0.5]), stays, np.zeros((1, 2)), np.eye(2))
    belief = StateBelief(world, 0)
    belief.update(0, 1)
    assert belief.probabilities.tolist() == [0.0, 1.0]
