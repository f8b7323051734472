"""The policy file: exact to the bit, readable, and refused in one line where it contradicts itself or the task."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.contracts import CONTEXT, Practice
from palpate.core.errors import ConfigurationError
from palpate.core.policy import (
    Action,
    ActionEntry,
    ControllerKind,
    ExamplesPolicy,
    HmmLearner,
    HmmParameters,
    LearnerEntry,
    MixedPolicy,
    PolicyDocument,
    ProgrammedPolicy,
    QLearning,
    QParameters,
    RandomWalkPolicy,
    Spatial,
    TemperatureSchedule,
    compass_actions,
    document_of,
    learner_of,
    new_learner,
    policy_from,
)
from palpate.core.policy.belief import BeliefParameters
from tests.unit.core.policy.bench import LEFT, TWO

ACTIONS = compass_actions(0.001)
STATES = ("a", "b")
FOUR = CONTEXT.states
Q = QParameters(alpha=0.3, gamma=1.0, temperature=TemperatureSchedule(5.0, 0.96, 0.1))
numbers = st.floats(allow_nan=False, allow_infinity=False) | st.sampled_from([-0.0, 5e-324, -5e-324, -1e308])


def document(q=(0.0,) * 8, visits=(0,) * 8, **settings):
    state = {"q": [list(q)] * 2, "visits": [list(visits)] * 2, "trials_learned": 12}
    made = PolicyDocument(
        created_with={"palpate": "0.1.0"},
        perception={"thresholds_mm": [-1.0, 1.0]},
        states=STATES,
        actions=tuple(ActionEntry.of(action) for action in ACTIONS),
        programmed={"b": "-x"},
        examples={},
        learner=LearnerEntry("q-learning", Q, state),
    )
    return replace(made, **settings)


def written(policy):
    """What a file holds of a policy, once it was read back."""
    made = document_of(policy, created_with={"palpate": "0"}, perception={})
    read = PolicyDocument.from_json_text(made.to_json_text())
    assert read == made
    return read


def require_refused(made, field):
    """The text is refused in one line that names the field."""
    with pytest.raises(ConfigurationError) as refused:
        PolicyDocument.from_json_text(json.dumps(made))
    assert refused.value.field == field
    assert len(str(refused.value).splitlines()) == 1


def learned():
    learner = QLearning(FOUR, CONTEXT.actions, Q)
    Practice(CONTEXT).trials(learner, range(10))
    return learner


class TestFormat:
    @given(st.lists(numbers, min_size=8, max_size=8), st.lists(st.integers(0, 10**9), min_size=8, max_size=8))
    def test_file_reads_back_to_the_bit(self, q, visits):
        made = document(tuple(q), tuple(visits))
        text = made.to_json_text()
        read = PolicyDocument.from_json_text(text)
        assert read == made
        assert [value.hex() for value in read.table[0].q or ()] == [value.hex() for value in q]
        assert read.to_json_text() == text


class TestTask:
    @pytest.mark.parametrize(
        ("states", "actions", "field", "accepted"),
        [
            (("a", "c"), ACTIONS, "states[1]", "'c'"),
            (("a", "b", "c"), ACTIONS, "states", "3 of them"),
            (STATES, compass_actions(0.001, 4), "actions[0]", "'0deg'"),
            (STATES, ACTIONS[:7], "actions", "7 of them"),
            (STATES, (*ACTIONS[:7], Action("+x-y", (0.0, 0.0))), "actions[7].displacement_mm", "(0.0, 0.0)"),
        ],
    )
    def test_another_task_is_refused_with_first_difference(self, states, actions, field, accepted):
        with pytest.raises(ConfigurationError) as refused:
            document().check_matches(states, actions)
        assert refused.value.field == field
        assert accepted in refused.value.accepted

    def test_actions_in_six_degrees_of_freedom_read_back(self):
        spatial = Spatial(ControllerKind.PUSH, 1e-3, (0.1, -0.2, 0.3), (3.0, -1.0), (20e-3, 0.0))
        actions = (*ACTIONS[:-1], Action(ACTIONS[-1].name, (1e-3, 0.0), spatial))
        made = document(actions=tuple(map(ActionEntry.of, actions)))
        assert PolicyDocument.from_json_text(made.to_json_text()) == made
        assert Spatial.of(spatial.controller.value, spatial.numbers) == spatial
        made.check_matches(STATES, actions)
        with pytest.raises(ConfigurationError, match=r"actions\[7\].displacement_mm"):
            made.check_matches(STATES, ACTIONS)
        turned = replace(actions[-1], spatial=replace(spatial, turn_rad=(0.1, -0.2, 0.31)))
        with pytest.raises(ConfigurationError, match=r"actions\[7\].spatial.turn_deg"):
            made.check_matches(STATES, (*actions[:-1], turned))


class TestPoliciesInFiles:
    def test_rows_say_which_knowledge_decides_and_what_was_learned_there(self):
        q = learned()
        programmed = ProgrammedPolicy(FOUR, CONTEXT.actions, {"b": "-x-y"})
        examples = ExamplesPolicy(FOUR, CONTEXT.actions, [("c", "+y"), ("b", "+x")])
        read = written(MixedPolicy(FOUR, [programmed, examples, q]))
        assert [row.source for row in read.table] == ["learned", "programmed", "examples", "learned"]
        assert [row.action for row in read.table][1:3] == ["-x-y", "+y"]
        for state, row in enumerate(read.table):
            assert row.q == q.q[state]
            assert row.visits == sum(q.visits[state])
        assert read.table[0].value == max(q.q[0])
        assert read.table[1].value == q.q[1][5]
        assert written(policy_from(read, FOUR, CONTEXT.actions)) == read
        # Before it learned, what was programmed or came from examples stays.
        assert [row.source for row in read.unlearned().table] == [row.source for row in read.table]
        assert {value for row in read.unlearned().table for value in row.q or ()} == {0.0}

    @pytest.mark.parametrize("kind", [ProgrammedPolicy, ExamplesPolicy])
    def test_fixed_knowledge_comes_back_as_its_own_kind(self, kind):
        pairs = {"a": "+x", "b": "-x", "c": "-x", "d": "+x-y"}
        policy = kind(FOUR, ACTIONS, pairs if kind is ProgrammedPolicy else pairs.items())
        read = written(policy)
        assert (read.learner, learner_of(policy), read.unlearned()) == (None, None, read)
        back = policy_from(read, FOUR, ACTIONS)
        assert type(back) is kind
        assert [back.assigned(s) for s in range(4)] == [0, 4, 4, 7]

    @pytest.mark.parametrize(
        ("policy", "says"),
        [
            (RandomWalkPolicy(ACTIONS), "RandomWalkPolicy"),
            (MixedPolicy(FOUR, [MixedPolicy(FOUR, [learned()])]), "MixedPolicy"),
            (MixedPolicy(FOUR, [learned(), learned()]), "several learners"),
            (MixedPolicy(FOUR, [learned(), ProgrammedPolicy(("a",), ACTIONS, {})]), "parts that differ"),
            (ProgrammedPolicy(FOUR, ACTIONS, {"a": "+x"}), "no action for 'b'"),
        ],
    )
    def test_policy_that_no_file_can_express_is_refused(self, policy, says):
        with pytest.raises(ConfigurationError, match=says):
            document_of(policy, created_with={}, perception={})

    def test_belief_has_touch_model_once_it_learned_and_damaged_trial_is_named(self):
        learner = new_learner(BeliefParameters(), FOUR, CONTEXT.actions, CONTEXT.bounds)
        policy = MixedPolicy(FOUR, [ProgrammedPolicy(FOUR, CONTEXT.actions, {}), learner])
        Practice(CONTEXT).trials(policy, range(2))
        read = written(policy)
        assert read.learner.contact_model is not None
        blank = read.unlearned().learner
        assert blank.contact_model is None
        made = json.loads(read.to_json_text())
        made["learner"]["state"]["trials"][1]["contacts"][0] = [1, 2, 3]
        require_refused(made, "learner.trials[1]")

    def test_fitted_model_of_hidden_states_goes_on_from_its_file(self):
        learner = HmmLearner(STATES, TWO, HmmParameters(reach=3))
        policy = MixedPolicy(STATES, [ProgrammedPolicy(STATES, TWO, {"a": LEFT}), learner])
        context = replace(CONTEXT, states=STATES, actions=TWO)
        Practice(context).trials(policy, range(31))
        read = written(policy)
        again = policy_from(read, STATES, TWO, frozen=True)
        again.begin_trial(31, np.random.default_rng(31))
        twin = learner_of(again)
        assert isinstance(twin, HmmLearner)
        learner.begin_trial(31, np.random.default_rng(31))
        assert twin.model.emissions.tolist() == learner.model.emissions.tolist()
        made = json.loads(read.to_json_text())
        made["learner"]["state"]["trials"][4]["symbols"][0] = 2
        require_refused(made, "learner.trials[4].symbols")
