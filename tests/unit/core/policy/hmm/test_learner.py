"""The learner on a map: near the optimum, repeatable, and taken up again where it stood."""

import numpy as np
import pytest

from palpate.adapters.config.grid import GridLearning
from palpate.adapters.experiments.grid import Named, learn
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState
from palpate.core.policy import (
    Hindsight,
    HmmLearner,
    HmmParameters,
    MixedPolicy,
    ProgrammedPolicy,
    Transition,
)
from palpate.core.policy.hmm import RecordedTrial, StateBelief
from palpate.core.policy.hmm.learner import PATIENCE, fitted_after
from palpate.simulation.grid import GridMap, belief_optimum, grid_actions, run_trial, walks_from_all_cells
from tests.unit.core.policy.bench import observation
from tests.unit.core.policy.hmm.worlds import AMBIGUOUS, random_trials, true_offsets

HMM = GridLearning(learner="hmm", reach=3)


def test_after_forty_trials_it_is_near_the_optimum_and_a_state_goes_on_as_the_learner_it_is_of() -> None:
    run = learn(AMBIGUOUS, Named(), HMM, seed=3, trials=45)
    walks = walks_from_all_cells(AMBIGUOUS, run.identifier, run.learner.as_frozen())
    steps, optimum = np.mean([walk.steps for walk in walks]), float(belief_optimum(AMBIGUOUS))
    assert all(walk.reached for walk in walks)
    assert optimum - 1e-9 <= steps <= 1.2 * optimum
    # A learner that is set to a state goes on as the one that it is of.
    other = HmmLearner(AMBIGUOUS.symbols, grid_actions(), run.learner.parameters)
    other.set_state(run.learner.get_state())
    assert other.trials_learned == 45
    identity = IdentityState(AMBIGUOUS.symbols)
    walks = [run_trial(AMBIGUOUS, identity, each, 3, 45) for each in (run.learner, other)]
    assert walks[0] == walks[1]


def test_frozen_it_learns_nothing_and_trials_of_another_alphabet_are_refused() -> None:
    learner = learn(AMBIGUOUS, Named(), HMM, seed=3, trials=2).learner
    frozen, before = learner.as_frozen(), learner.get_state()
    run_trial(AMBIGUOUS, IdentityState(AMBIGUOUS.symbols), frozen, 3, 0)
    assert frozen.get_state() == before
    other = HmmLearner(("A", "B"), grid_actions(), learner.parameters)
    with pytest.raises(ConfigurationError, match=r"learner.trials\[\d+\].symbols = 2 is refused: numbers from 0 to 1"):
        other.set_state(before)


def test_a_trial_that_was_cut_off_is_remembered_up_to_its_last_whole_action() -> None:
    learner = HmmLearner(AMBIGUOUS.symbols, grid_actions(), HmmParameters())
    learner.begin_trial(0, np.random.default_rng(0))
    for symbol in (0, 1):
        learner.choose(observation(symbol))
        learner.learn(Transition(symbol, 3, -1.0, symbol + 1))
    learner.choose(observation(2))
    learner.end_trial(Hindsight(False, (0.0, 0.0, 0.0), 0.0))
    assert learner.trials == (RecordedTrial((0, 1, 2), (3, 3), reached=False),)


def test_what_is_read_where_another_part_of_the_policy_acts_counts_too() -> None:
    learner, programmed = learn(AMBIGUOUS, Named(), HMM, seed=3, trials=31).learner, {"B": "+x"}
    policy = MixedPolicy(
        AMBIGUOUS.symbols, [ProgrammedPolicy(AMBIGUOUS.symbols, grid_actions(), programmed), learner.as_frozen()]
    )
    identity = IdentityState(AMBIGUOUS.symbols)
    walk = run_trial(AMBIGUOUS, identity, policy, 3, 40)
    model = policy.parts[1]
    assert isinstance(model, HmmLearner)
    belief = StateBelief(model.model.pomdp(), walk.symbols[0])
    for action, symbol in zip(walk.actions, walk.symbols[1:], strict=False):
        belief.update(action, symbol)
    assert "B" in [AMBIGUOUS.symbols[symbol] for symbol in walk.symbols]
    assert model._belief.probabilities.tolist() == belief.probabilities.tolist()


@pytest.mark.parametrize(("due", "fitted"), [(150, [*range(50), *range(100, 150)]), (60, [*range(60)])])
def test_a_model_is_fitted_to_the_first_trials_and_to_the_last(due: int, fitted: list[int]) -> None:
    parameters = HmmParameters(memory_trials=100)
    learner = HmmLearner(AMBIGUOUS.symbols, grid_actions(), parameters)
    learner.use(None, [RecordedTrial((0,) * (k + 1), (0,) * (k + 1), True) for k in range(due)])
    assert [len(trial.actions) - 1 for trial in learner._fitting(due)] == fitted


def test_the_same_trials_are_not_fitted_again() -> None:
    learner = learn(AMBIGUOUS, Named(), HMM, seed=3, trials=31).learner
    before, state = learner.model, learner.get_state()
    learner.set_state(state)
    assert learner.model is before
    state["trials"][0] = state["trials"][1]
    learner.set_state(state)
    assert learner.model is None


def test_models_are_fitted_anew_after_ever_more_trials() -> None:
    told = [fitted_after(n) for n in (0, 29, 30, 99, 100, 749, 750, 2000)]
    assert told == [0, 0, 30, 60, 100, 500, 750, 1687]


def test_hidden_states_are_found_on_symbols_alone() -> None:
    with pytest.raises(ConfigurationError, match="symbols, with the learner hmm"):
        learn(AMBIGUOUS, Named("last-2"), GridLearning(learner="hmm"), 0, 1)


def test_a_frozen_learner_whose_model_is_wrong_goes_round_in_circles_but_not_for_ever() -> None:
    here, elsewhere = GridMap.from_text("AAB·"), GridMap.from_text("B·AA")
    learner = HmmLearner(here.symbols, grid_actions(), HmmParameters(), frozen=True)
    learner.use(true_offsets(elsewhere), random_trials(here, 30))
    walks = walks_from_all_cells(here, IdentityState(here.symbols), learner, step_limit=1000, walks=2)
    assert all(walk.reached for walk in walks)
    assert np.mean([walk.steps for walk in walks]) > PATIENCE


def test_where_a_frozen_plan_failed_chance_is_tried_and_then_the_plan_anew() -> None:
    here, elsewhere = GridMap.from_text("AAB·"), GridMap.from_text("·AAB")
    learner = HmmLearner(here.symbols, grid_actions(), HmmParameters(), frozen=True)
    learner.use(true_offsets(elsewhere), random_trials(here, 30))
    rng = np.random.default_rng(0)
    learner.begin_trial(0, rng)
    drawn = []
    for _ in range(6 * PATIENCE):
        before = rng.bit_generator.state
        decision = learner.choose(observation(0))
        assert decision.index is not None
        learner.learn(Transition(0, decision.index, -1.0, 0))
        drawn.append(rng.bit_generator.state != before)
    assert drawn == [False] * PATIENCE + [True] * 4 * PATIENCE + [False] * PATIENCE
