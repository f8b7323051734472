from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import CommandError
from palpate.core.policy.reinforcement import ActionOutcome, ActionPenalty, InternalEffort
from tests.unit.core.policy.bench import refuse

sizes = st.floats(0.0, 1e3)
outcomes = st.builds(ActionOutcome, sizes, sizes)


@given(outcomes, st.floats(-1e3, -1e-6))
def test_the_action_penalty_is_the_same_for_every_action(outcome, penalty):
    assert ActionPenalty(penalty)(outcome) == penalty


def test_effort_of_a_hand_computed_action():
    effort = InternalEffort(per_action=-0.5, per_N_s=-2.0, free_force_N=5.0)
    # 3 N above the free force for 0.1 s: 0.3 N s
    assert effort(ActionOutcome(0.1, 8.0)) == pytest.approx(-0.5 - 2.0 * 0.3)
    assert effort(ActionOutcome(0.1, 4.0)) == -0.5


@given(outcomes, st.floats(-10.0, -1e-6), st.floats(-10.0, 0.0), sizes)
def test_effort_never_rewards(outcome, per_action, per_N_s, free_force_N):
    assert InternalEffort(per_action, per_N_s, free_force_N)(outcome) <= per_action


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: ActionPenalty(0.0), "per_action"),
        (lambda: ActionPenalty(1.0), "per_action"),
        (lambda: ActionPenalty(nan), "per_action"),
        (lambda: InternalEffort(per_action=0.1), "per_action"),
        (lambda: InternalEffort(per_N_s=0.1), "per_N_s"),
        (lambda: InternalEffort(per_N_s=-inf), "per_N_s"),
        (lambda: InternalEffort(0.0, 0.0), "per_N_s"),
        (lambda: InternalEffort(free_force_N=-1.0), "free_force_N"),
    ],
)
def test_a_reinforcement_that_could_reward_effort_is_refused(make, field):
    refuse(f"reinforcement.{field}", make)


@pytest.mark.parametrize("position", range(2))
@pytest.mark.parametrize("bad", [-0.1, nan, inf])
def test_an_outcome_is_finite_and_not_negative(position, bad):
    values = [0.1, 1.0]
    values[position] = bad
    with pytest.raises(CommandError):
        ActionOutcome(*values)
