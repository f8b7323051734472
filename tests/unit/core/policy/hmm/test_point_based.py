"""The planner against exact optima."""

import numpy as np
import pytest

from palpate.core.perception import IdentityState
from palpate.core.policy import HmmLearner, HmmParameters
from palpate.core.policy.hmm import FinitePomdp
from palpate.core.policy.hmm.point_based import perseus, qmdp
from palpate.simulation.grid import GridMap, belief_optimum, grid_actions, walks_from_all_cells
from palpate.simulation.grid.maps import SCENARIO_1, SCENARIO_2
from tests.unit.core.policy.hmm.worlds import AMBIGUOUS, random_pomdp, random_trials, true_offsets

MAPS = [AMBIGUOUS, GridMap.from_regions(SCENARIO_1), GridMap.from_regions(SCENARIO_2)]


@pytest.mark.parametrize("grid", MAPS, ids=["walls", "1", "2"])
def test_on_the_true_model_a_policy_comes_within_a_hundredth_of_the_optimum_of_the_belief(grid: GridMap) -> None:
    learner = HmmLearner(grid.symbols, grid_actions(), HmmParameters(), frozen=True)
    learner.use(true_offsets(grid), random_trials(grid, 30))
    walks = walks_from_all_cells(grid, IdentityState(grid.symbols), learner)
    steps = np.mean([walk.steps for walk in walks])
    optimum = float(belief_optimum(grid))
    assert optimum - 1e-9 <= steps <= 1.01 * optimum


def test_qmdp_takes_for_granted_what_a_plan_pays_for() -> None:
    # Left or right of the goal, unseen: the wrong way costs two steps more.
    right, left = np.zeros((2, 2)), np.zeros((2, 2))
    right[1, 1] = left[0, 0] = 1.0
    goal = np.array([[1.0, 0.0], [0.0, 1.0]])
    world = FinitePomdp(np.array([0.5, 0.5]), np.stack([right, left]), goal, np.ones((2, 1)))
    np.testing.assert_allclose(qmdp(world), [[1.0, 1.98], [1.98, 1.0]], atol=1e-5)
    plan = perseus(world, np.random.default_rng(0))
    # 1, then with probability a half one more, discounted by 0.98.
    np.testing.assert_allclose(plan.costs(np.array([0.5, 0.5])), [1.49, 1.49], atol=1e-4)


@pytest.mark.parametrize("few", [False, True])
def test_leaving_out_what_is_nothing_changes_no_bit_of_a_cost(few: bool) -> None:
    rng = np.random.default_rng(0)
    world = true_offsets(MAPS[1]).pomdp() if few else random_pomdp(rng, 40, 3, 4)
    plan = perseus(world, rng)
    for belief in rng.dirichlet(np.full(world.states, 0.02), size=20):
        moved = np.einsum("s,ast->at", belief, world.transitions)
        for action in range(world.actions):
            np.testing.assert_array_equal(world.moved(belief, action), moved[action])
        joint = np.rint(moved[:, None, :] * world.emissions.T * 2.0**22).reshape(-1, world.states)
        promised = (joint @ np.rint(plan.vectors * 2.0**20).T).min(axis=1).reshape(world.actions, -1) / 2.0**42
        np.testing.assert_array_equal(plan.costs(belief), 1.0 + 0.98 * promised.sum(axis=1))
