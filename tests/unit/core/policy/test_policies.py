"""Actions, what passes between task and policy, programmed and mixed policies, and reinforcement."""

from math import cos, hypot, inf, nan, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.policy import (
    Action,
    ActionOutcome,
    ActionPenalty,
    AssignedPolicy,
    ExamplesPolicy,
    InternalEffort,
    MixedPolicy,
    ProgrammedPolicy,
    QLearning,
    QParameters,
    TemperatureSchedule,
    Transition,
    check_known,
    compass_actions,
)
from palpate.core.policy.base import check_names
from tests.unit.core.policy.bench import EIGHT, LEFT, RIGHT, TWO, Diary, observation, refuse

STATES = ("a", "b", "c")


class TestActions:
    def test_axis_steps_are_exact_and_opposite_steps_cancel_to_the_bit(self):
        actions = {a.name: a.displacement_m for a in compass_actions(0.001)}
        assert actions["+x"] == (0.001, 0.0)
        assert actions["-y"] == (0.0, -0.001)
        assert actions["+x+y"][0] == actions["+x+y"][1]
        for name, (x, y) in actions.items():
            opposite = actions[name.translate(str.maketrans("+-", "-+"))]
            assert (x + opposite[0], y + opposite[1]) == (0.0, 0.0)
            assert not {repr(x), repr(y)} & {"-0.0"}

    @given(st.floats(1e-5, 0.1), st.integers(2, 72))
    def test_directions_are_equally_spaced_and_equally_long(self, step_m, directions):
        actions = compass_actions(step_m, directions)
        assert len({a.name for a in actions}) == directions
        for k, action in enumerate(actions):
            angle = radians(360.0 * k / directions)
            assert hypot(*action.displacement_m) == pytest.approx(step_m, rel=1e-12)
            wanted = (step_m * cos(angle), step_m * sin(angle))
            assert action.displacement_m == pytest.approx(wanted, abs=1e-14)

    @pytest.mark.parametrize("step_m", [0.0, -1.0, nan, inf])
    def test_unusable_actions_are_refused(self, step_m):
        refuse("actions.step_m", compass_actions, step_m)
        refuse("actions.directions", compass_actions, 0.001, 1)
        refuse("actions.displacement_m", Action, "nowhere", (0.0, nan))

    @pytest.mark.parametrize("states", [(), ("a", "a"), ("a", ""), ("a", "two\nlines")])
    def test_names_are_distinct_and_printable(self, states):
        with pytest.raises(ConfigurationError, match=r"^policy\.states"):
            check_names(states, compass_actions(0.001))
        refuse("policy.actions[1]", check_names, ("a",), (Action("go", (1.0, 0.0)), Action("go", (0.0, 1.0))))

    @pytest.mark.parametrize(
        "bad",
        [(-1, 0, -1.0, 0), (0, -1, -1.0, 0), (0, 0, -1.0, -1), (0, 0, -1.0, 0, -1), (0, 0, nan, 1), (0, 0, -inf, 1)],
    )
    def test_transition_that_would_spoil_table_is_refused(self, bad):
        with pytest.raises(CommandError, match=r"must not be negative|finite"):
            Transition(*bad)
        with pytest.raises(CommandError, match="state"):
            observation(-1)


class TestAssignedPolicies:
    def test_only_states_with_action_are_served(self):
        policy = AssignedPolicy(("a", "b"), EIGHT, (0, None), "programmed")
        assert [policy.serves(0), policy.serves(1)] == [True, False]
        assert [policy.assigned(0), policy.assigned(1)] == [0, None]
        with pytest.raises(ConfigurationError, match=r"policy\.programmed must be .*mixed policy"):
            policy.choose(observation(1))

    def test_unknown_names_are_refused_with_all_that_is_accepted(self):
        with pytest.raises(ConfigurationError, match=r"here must be a state of this task: a, b"):
            check_known("here", "c", "+x", ("a", "b"), EIGHT)
        with pytest.raises(ConfigurationError, match=r"here must be .*'a'.*\+x, \+x\+y, \+y"):
            check_known("here", "a", "up", ("a", "b"), EIGHT)
        refuse("policy.examples", ExamplesPolicy, STATES, EIGHT, [("d", "+x")])

    def test_majority_of_examples_decides_and_ties_go_to_first_action(self):
        shown = [("a", "-y"), ("a", "+y"), ("a", "-y"), ("b", "-x"), ("b", "+x")]
        policy = ExamplesPolicy(STATES, EIGHT, shown)
        names = [action.name for action in EIGHT]
        assert [policy.assigned(state) for state in range(3)] == [names.index("-y"), names.index("+x"), None]
        assert policy.choose(observation(0)).source == "examples"


class TestMixedPolicy:
    def learner(self):
        return QLearning(STATES, TWO, QParameters(alpha=1.0, gamma=1.0, temperature=TemperatureSchedule(2.0, 0.5, 0.5)))

    def test_first_part_that_serves_state_decides(self):
        programmed = ProgrammedPolicy(STATES, TWO, {"a": LEFT})
        examples = ExamplesPolicy(STATES, TWO, [("a", RIGHT), ("b", RIGHT)])
        policy = MixedPolicy(STATES, [programmed, examples, self.learner()])
        policy.begin_trial(0, np.random.default_rng(0))
        decisions = [policy.choose(observation(state)) for state in range(3)]
        assert [decision.source for decision in decisions] == ["programmed", "examples", "learned"]
        assert [decision.index for decision in decisions[:2]] == [1, 0]
        assert policy.part_for(1) is examples

    def test_learner_values_programmed_states_by_programmed_action(self):
        """The untried action of b keeps Q = 0; b must be worth -4 all the same, not as much as the goal."""
        q = self.learner()
        policy = MixedPolicy(STATES, [ProgrammedPolicy(STATES, TWO, {"b": RIGHT}), q])
        for state in (1, 2):
            policy.learn(Transition(state, 0, -4.0, None))
        policy.learn(Transition(0, 0, -1.0, 1))
        policy.learn(Transition(0, 1, -1.0, 2))
        assert q.q == ((-5.0, -1.0), (-4.0, 0.0), (-4.0, 0.0))

    def test_states_without_part_are_named(self):
        orphaned = refuse("policy.mixed", MixedPolicy, STATES, [ProgrammedPolicy(STATES, TWO, {"b": LEFT})])
        assert orphaned.value == "a, c"
        diary = Diary()
        policy = MixedPolicy(STATES, [diary])
        diary.served = (0,)  # the others no longer
        assert [policy.serves(state) for state in range(3)] == [True, False, False]
        with pytest.raises(ConfigurationError, match="'b'"):
            policy.choose(observation(1))


sizes = st.floats(0.0, 1e3)
outcomes = st.builds(ActionOutcome, sizes, sizes)


class TestReinforcement:
    def test_effort_has_hand_computed_value(self):
        effort = InternalEffort(per_action=-0.5, per_N_s=-2.0, free_force_N=5.0)
        # 3 N above the free force for 0.1 s: 0.3 N s
        assert effort(ActionOutcome(0.1, 8.0)) == pytest.approx(-0.5 - 2.0 * 0.3)
        assert effort(ActionOutcome(0.1, 4.0)) == -0.5

    @given(outcomes, st.floats(-10.0, -1e-6), st.floats(-10.0, 0.0), sizes)
    def test_effort_never_rewards(self, outcome, per_action, per_N_s, free_force_N):
        assert InternalEffort(per_action, per_N_s, free_force_N)(outcome) <= per_action

    @pytest.mark.parametrize(
        ("make", "field"),
        [
            (lambda: ActionPenalty(0.0), "per_action"),
            (lambda: InternalEffort(per_action=0.1), "per_action"),
            (lambda: InternalEffort(per_N_s=-inf), "per_N_s"),
            (lambda: InternalEffort(0.0, 0.0), "per_N_s"),
        ],
    )
    def test_reinforcement_that_could_reward_effort_is_refused(self, make, field):
        refuse(f"reinforcement.{field}", make)
