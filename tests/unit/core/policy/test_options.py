"""Actions that go on until something new is felt, and tables that quarter turns share."""

import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Hindsight, Transition
from palpate.core.policy.conversion import document_of, new_learner, policy_from
from palpate.core.policy.exploration import TemperatureSchedule
from palpate.core.policy.file import PolicyDocument
from palpate.core.policy.options import OptionLearning, OptionParameters, quarter_turns
from palpate.core.policy.tabular import QParameters
from tests.unit.core.policy.bench import EIGHT, GREEDY, TWO, observation

STATES = ("x+ y0", "x+ y+", "x0 y+", "x- y+", "x- y0", "x- y-", "x0 y-", "x+ y-", "tx0 ty0")
HINDSIGHT = Hindsight(False, (0.0, 0.0, 0.0), 0.0)


def learner(temperature: TemperatureSchedule = GREEDY, **settings) -> OptionLearning:
    plain = {"alpha": 1.0, "gamma": 0.5, "keep_steps": 3}
    made = OptionLearning(STATES, EIGHT, OptionParameters(**plain | settings, temperature=temperature))
    made.begin_trial(0, np.random.default_rng(5))
    return made


def step(one: OptionLearning, state: int, after: int | None) -> int:
    """One step and what came of it; gives the action."""
    index = one.choose(observation(state)).index
    assert index is not None
    one.learn(Transition(state, index, -1.0, after))
    return index


def test_an_action_goes_on_until_the_state_changes_and_is_judged_by_what_is_found_there() -> None:
    one = learner(TemperatureSchedule(9.0, 1.0, 9.0), initial_value=-4.0)
    first = step(one, 0, 0)
    assert one.visits[0] == (0,) * 8
    assert step(one, 0, 1) == first
    # -1 - 0.5, and half of the half of what state 1 is worth.
    assert one.q[0][first] == -1.5 + 0.25 * -4.0
    assert one.visits[0][first] == 1


def test_it_ends_after_so_many_steps_and_at_the_trials_end() -> None:
    hot = TemperatureSchedule(9.0, 1.0, 9.0)
    one, actions = learner(hot), []
    for _ in range(300):
        actions.append(step(one, 0, 0))
    assert all(len(set(actions[k : k + 3])) == 1 for k in range(0, 300, 3))
    assert len(set(actions)) == 8
    assert sum(one.visits[0]) == 100
    step(one, 1, 1)
    assert sum(one.visits[1]) == 0
    one.end_trial(HINDSIGHT)
    one.end_trial(HINDSIGHT)
    assert sum(one.visits[1]) == 1


def test_with_one_step_it_is_q_learning() -> None:
    settings = {"alpha": 0.3, "gamma": 0.9, "temperature": TemperatureSchedule(1.0, 1.0, 1.0), "initial_value": -2.0}
    plain = new_learner(QParameters(**settings), STATES, EIGHT)
    kept = OptionLearning(STATES, EIGHT, OptionParameters(**settings))
    for one in (plain, kept):
        rng, moves = np.random.default_rng(3), np.random.default_rng(4)
        one.begin_trial(0, rng)
        for _ in range(200):
            state = int(moves.integers(9))
            index = one.choose(observation(state)).index
            assert index is not None
            after = int(moves.integers(10))
            one.learn(Transition(state, index, -1.0, None if after == 9 else after))
    assert plain.q == kept.q
    assert plain.visits == kept.visits


def test_quarter_turns_share_what_is_learned() -> None:
    one = learner(share_turns=True, keep_steps=1)
    one.learn(Transition(0, 4, -1.0, None))  # x+ y0: -x
    turned = [("x+ y0", "-x"), ("x0 y+", "-y"), ("x- y0", "+x"), ("x0 y-", "+y")]
    names = [action.name for action in EIGHT]
    learned = {(s, a) for s, row in enumerate(one.q) for a, value in enumerate(row) if value}
    assert learned == {(STATES.index(state), names.index(action)) for state, action in turned}
    assert sum(map(sum, one.visits)) == 4
    # A region with the middle on all sides is its own quarter turn.
    assert quarter_turns(STATES, EIGHT)[0][0][8] == 8


@pytest.mark.parametrize(("states", "actions", "value"), [(("a",), EIGHT, "a"), (STATES, TWO, "0deg")])
def test_what_has_no_quarter_turns_is_refused(states, actions, value) -> None:
    with pytest.raises(ConfigurationError) as caught:
        quarter_turns(states, actions)
    assert (caught.value.field, caught.value.value) == ("policy.share_turns", value)


def test_they_go_on_from_their_file() -> None:
    one = learner(share_turns=True)
    step(one, 0, None)
    text = document_of(one, created_with={}, perception={}).to_json_text()
    back = policy_from(PolicyDocument.from_json_text(text), STATES, EIGHT, frozen=False)
    assert isinstance(back, OptionLearning)
    assert back.parameters == one.parameters
    assert (back.q, back.visits) == (one.q, one.visits)
