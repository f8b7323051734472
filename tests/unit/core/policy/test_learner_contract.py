"""The contract of learners, over all of them; each clause finds the learner that breaks it."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest

from palpate.adapters.contracts import CONTEXT, ContractViolation, LearnerContract, Practice, third_party
from palpate.core.errors import ConfigurationError
from palpate.core.policy import (
    HmmParameters,
    MixedPolicy,
    OptionParameters,
    PolicyDocument,
    ProgrammedPolicy,
    QLearning,
    QParameters,
    SarsaParameters,
    TemperatureSchedule,
    document_of,
    learner_of,
    new_learner,
    policy_from,
)
from palpate.core.policy.belief import BeliefParameters
from tests.unit.core.policy.bench import Counting

COOLING = TemperatureSchedule(5.0, 0.9, 0.5)
Q = QParameters(alpha=0.3, gamma=1.0, temperature=COOLING, alpha_visits=15.0, alpha_floor=0.05, initial_value=-0.0)
PARAMETERS = {
    "q-learning": Q,
    "sarsa": SarsaParameters(alpha=0.2, gamma=1.0, temperature=COOLING, trace_decay=0.7),
    "options": OptionParameters(alpha=0.2, gamma=0.9, temperature=COOLING),
    "belief": BeliefParameters(restart_steps=7),
    "hmm": HmmParameters(reach=2, lattice=1),
}
NAMES = CONTEXT.states, CONTEXT.actions


class TestOwnLearners(LearnerContract):
    @pytest.fixture(params=PARAMETERS, autouse=True)
    def _of_kind(self, request):
        self.parameters = PARAMETERS[request.param]

    def make(self, *, frozen=False):
        return new_learner(self.parameters, *NAMES, CONTEXT.bounds, frozen=frozen)

    def test_policy_file_resumes_learning_with_what_is_programmed(self):
        learner = self.make()
        policy = MixedPolicy(CONTEXT.states, [ProgrammedPolicy(*NAMES, {"b": "-x"}), learner])
        self.practised(policy)
        written = document_of(policy, created_with={"palpate": "0"}, perception={})
        read = PolicyDocument.from_json_text(written.to_json_text())
        assert read == written
        resumed = policy_from(read, *NAMES, CONTEXT.bounds, frozen=False)
        twin = learner_of(resumed)
        assert isinstance(twin, type(learner))
        assert twin.parameters == learner.parameters
        later, practice = range(4, 8), Practice(CONTEXT, seed=1)
        assert practice.trials(resumed, later) == practice.trials(policy, later)
        assert twin.get_state() == learner.get_state()
        unlearned = read.unlearned()
        assert unlearned.learner.trials_learned == 0
        fresh = MixedPolicy(CONTEXT.states, [ProgrammedPolicy(*NAMES, {"b": "-x"}), self.make()])
        assert unlearned == document_of(fresh, created_with={"palpate": "0"}, perception={})


class TestThirdPartyLearner(LearnerContract):
    def make(self, *, frozen=False):
        return third_party(Counting(), frozen=frozen)


class FirstTrialUnseeded(QLearning):
    """Draws its first trial by itself, and learns nothing of it but that it was."""

    def begin_trial(self, trial, rng):
        super().begin_trial(trial, rng if trial else np.random.default_rng())
        self.first = trial == 0

    def learn(self, transition):
        if not self.first:
            super().learn(transition)
        elif not self.frozen and not self._trial_counted:
            self._trials_learned, self._trial_counted = self._trials_learned + 1, True


class Misplaced(QLearning):
    def choose(self, observation):
        return replace(super().choose(observation), index=0)


class CountsOneLess(QLearning):
    """Until its state is restored."""

    less = 1

    @property
    def trials_learned(self):
        return super().trials_learned - self.less

    def set_state(self, state):
        super().set_state(state)
        self.less = 0


class Stamped(QLearning):
    made: ClassVar[list[int]] = []

    def __init__(self, *arguments, **settings):
        super().__init__(*arguments, **settings)
        self.made.append(0)
        self.stamp = len(self.made)

    def get_state(self):
        return super().get_state() | {"stamp": self.stamp}

    def set_state(self, state):
        if not isinstance(state.get("stamp"), int):
            raise ConfigurationError("learner.stamp", state.get("stamp"), "a number")
        super().set_state(state)
        self.stamp = state["stamp"]


class Thawed(QLearning):
    def learn(self, transition):
        self.frozen = False
        super().learn(transition)


class Forgetful(QLearning):
    def set_state(self, state):
        super().set_state(state)
        super().set_state({**state, "q": [[0.0] * 8] * 4})


class Shared(QLearning):
    def get_state(self):
        return super().get_state() | {"q": self._q}


class Careless(QLearning):
    def set_state(self, state):
        self._q = [list(row) for row in state.get("q") or [[]]]
        super().set_state(state)


BROKEN = {
    FirstTrialUnseeded: "equal_seeds_give_equal_decisions",
    Misplaced: "decision_is_one_of_action_set_or_has_no_index",
    CountsOneLess: "trials_that_end_in_hole_are_counted",
    Stamped: "equal_trials_give_equal_state",
    Thawed: "frozen_learner_learns_nothing",
    Forgetful: "learner_resumes_from_its_state",
    Shared: "state_is_copy",
    Careless: "bad_state_is_refused_and_changes_nothing",
}


@pytest.mark.parametrize(("kind", "clause"), BROKEN.items())
def test_without_any_one_clause_a_broken_learner_passes(kind, clause):
    class Suite(LearnerContract):
        def make(self, *, frozen=False):
            return kind(*NAMES, Q, frozen=frozen)

    clauses = {name for name in dir(Suite) if name.startswith("test_")}
    assert clauses == {f"test_{each}" for each in BROKEN.values()}
    for name in clauses - {f"test_{clause}"}:
        getattr(Suite(), name)()
    with pytest.raises(ContractViolation):
        getattr(Suite(), f"test_{clause}")()
