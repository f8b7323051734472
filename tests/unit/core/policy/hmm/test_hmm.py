"""Hidden states behind symbols: the belief, the model of displacements, the plan, and the learner on a map."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.adapters.config.grid import GridLearning
from palpate.adapters.experiments.grid import learn, states_named
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState
from palpate.core.policy import Action, EpisodeOutcome, HmmLearner, HmmParameters, Transition, compass_actions
from palpate.core.policy.hmm import DisplacementHmm, FinitePomdp, RecordedTrial
from palpate.core.policy.hmm.baum_welch import Batch
from palpate.core.policy.hmm.displacement_hmm import fit_displacement_hmm, lattice_steps
from palpate.core.policy.hmm.learner import GREEDY_ACTIONS
from palpate.core.policy.hmm.point_based import StateBelief, perseus, qmdp
from palpate.simulation.grid import GridMap, belief_optimum, grid_actions, walks_from_all_cells
from palpate.simulation.grid.maps import SCENARIO_1, SCENARIO_2
from tests.unit.core.policy.bench import observation
from tests.unit.core.policy.hmm.worlds import AMBIGUOUS, STEPS, random_pomdp, random_trials, true_offsets


class TestBelief:
    @pytest.mark.parametrize("seed", range(5))
    def test_it_is_the_sum_over_all_paths(self, seed):
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

    def test_after_an_impossible_reading_it_begins_anew_with_that_reading(self):
        stays = np.eye(2)[None]
        world = FinitePomdp(np.array([0.5, 0.5]), stays, np.zeros((1, 2)), np.eye(2))
        belief = StateBelief(world, 0)
        belief.update(0, 1)
        assert belief.probabilities.tolist() == [0.0, 1.0]


def log_prior(model):
    """What the pseudo-counts add: the quantity that Baum-Welch never lowers has them in it."""
    n = len(model.offsets)
    squares = np.array([u * u + v * v for u, v in model.offsets])
    total = 0.05 * np.log(model.emissions).sum() + (0.5 * np.exp(-squares / 32.0) * np.log(model.start)).sum()
    free = model.targets() != n + 1
    blocked = model.blocked[free]
    return float(total + (0.1 * np.log(blocked) + 0.9 * np.log1p(-blocked)).sum())


class TestModel:
    @given(seed=st.integers(0, 10_000))
    @settings(max_examples=8, deadline=None)
    def test_no_iteration_loses_likelihood(self, seed):
        batch = Batch.of(random_trials(AMBIGUOUS, 12, seed))
        model = DisplacementHmm.blank(STEPS, 4, 3, np.random.default_rng(seed))
        before = -np.inf
        for _ in range(6):
            prior = log_prior(model)
            model, _, log_likelihood = model.improved(batch)
            assert log_likelihood + prior >= before - 1e-4
            before = log_likelihood + prior

    def test_the_map_is_found_from_random_walks(self):
        trials = random_trials(AMBIGUOUS, 150)
        found, truth = fit_displacement_hmm(trials, STEPS, 6, 3), true_offsets(AMBIGUOUS)
        assert set(truth.offsets) <= set(found.offsets)
        place = {offset: number for number, offset in enumerate(found.offsets)}
        message = [found.emissions[place[offset]].argmax() for offset in truth.offsets]
        assert message == list(truth.emissions.argmax(axis=1))

    def test_actions_on_no_lattice_are_refused_and_a_model_too_large_before_it_is_built(self):
        assert lattice_steps(grid_actions())[:3] == ((1, 0), (1, 1), (0, 1))
        with pytest.raises(ConfigurationError, match="whole multiples of the shortest"):
            lattice_steps(compass_actions(1e-3))
        # Along a diagonal 2.12 of three steps each way.
        assert lattice_steps(compass_actions(1e-3), 3)[:3] == ((3, 0), (2, 2), (0, 3))
        with pytest.raises(
            ConfigurationError, match="at least half a step along x or y, the longest side being 1 steps"
        ):
            lattice_steps((*compass_actions(1e-3), Action("nudge", (4e-4, 0.0))), 1)
        with pytest.raises(ConfigurationError, match="must be at most 2896"):
            HmmLearner(("A", "B"), grid_actions(), HmmParameters(reach=100))


MAPS = [AMBIGUOUS, GridMap.from_regions(SCENARIO_1), GridMap.from_regions(SCENARIO_2)]


class TestPlan:
    @pytest.mark.parametrize("grid", MAPS, ids=["walls", "1", "2"])
    def test_on_the_true_model_a_policy_comes_within_a_hundredth_of_the_optimum_of_the_belief(self, grid):
        learner = HmmLearner(grid.symbols, grid_actions(), HmmParameters(), frozen=True)
        learner.use(true_offsets(grid), random_trials(grid, 30))
        walks = walks_from_all_cells(grid, IdentityState(grid.symbols), learner)
        steps = np.mean([walk.steps for walk in walks])
        optimum = float(belief_optimum(grid))
        assert optimum - 1e-9 <= steps <= 1.01 * optimum

    def test_qmdp_takes_for_granted_what_a_plan_pays_for(self):
        # Left or right of the goal, unseen: the wrong way costs two steps more.
        right, left = np.zeros((2, 2)), np.zeros((2, 2))
        right[1, 1] = left[0, 0] = 1.0
        goal = np.array([[1.0, 0.0], [0.0, 1.0]])
        world = FinitePomdp(np.array([0.5, 0.5]), np.stack([right, left]), goal, np.ones((2, 1)))
        np.testing.assert_allclose(qmdp(world), [[1.0, 1.98], [1.98, 1.0]], atol=1e-5)
        plan = perseus(world, np.random.default_rng(0))
        # 1, then with probability a half one more, discounted by 0.98.
        np.testing.assert_allclose(plan.costs(np.array([0.5, 0.5])), [1.49, 1.49], atol=1e-4)


HMM = GridLearning(learner="hmm", reach=3)


class TestLearner:
    @pytest.mark.nightly
    def test_after_forty_trials_it_is_near_the_optimum_also_from_its_state(self):
        run = learn(AMBIGUOUS, IdentityState(AMBIGUOUS.symbols), HMM, seed=3, trials=45)
        frozen = HmmLearner(AMBIGUOUS.symbols, grid_actions(), run.learner.parameters, frozen=True)
        frozen.set_state(run.learner.get_state())
        walks = walks_from_all_cells(AMBIGUOUS, run.identifier, frozen)
        steps, optimum = np.mean([walk.steps for walk in walks]), float(belief_optimum(AMBIGUOUS))
        assert all(walk.reached for walk in walks)
        assert optimum - 1e-9 <= steps <= 1.2 * optimum

    def test_a_trial_that_was_cut_off_is_remembered_up_to_its_last_whole_action(self):
        learner = HmmLearner(AMBIGUOUS.symbols, grid_actions(), HmmParameters())
        learner.begin_trial(0, np.random.default_rng(0))
        for symbol in (0, 1):
            learner.choose(observation(symbol))
            learner.learn(Transition(symbol, 3, -1.0, symbol + 1))
        learner.choose(observation(2))
        learner.end_trial(EpisodeOutcome(False, (0.0, 0.0, 0.0), 0.0))
        assert learner.trials == (RecordedTrial((0, 1, 2), (3, 3), reached=False),)

    def test_hidden_states_are_found_on_symbols_alone(self):
        with pytest.raises(ConfigurationError, match="symbols, with the learner hmm"):
            learn(AMBIGUOUS, states_named("last-2", AMBIGUOUS), GridLearning(learner="hmm"), 0, 1)

    def test_a_frozen_learner_whose_model_is_wrong_goes_round_in_circles_but_not_for_ever(self):
        here, elsewhere = GridMap.from_text("AAB·"), GridMap.from_text("B·AA")
        learner = HmmLearner(here.symbols, grid_actions(), HmmParameters(), frozen=True)
        learner.use(true_offsets(elsewhere), random_trials(here, 30))
        walks = walks_from_all_cells(here, IdentityState(here.symbols), learner, step_limit=1000, walks=2)
        assert all(walk.reached for walk in walks)
        assert np.mean([walk.steps for walk in walks]) > GREEDY_ACTIONS
