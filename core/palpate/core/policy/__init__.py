"""From a state to an action: programmed, from examples, or learned from experience (paper, section 3.5)."""

from palpate.core.policy.back_off import BackingOff, BackOff
from palpate.core.policy.base import (
    EXAMPLES,
    LEARNED,
    PROGRAMMED,
    Action,
    Decision,
    FixedPolicy,
    Observation,
    Policy,
    Transition,
    compass_actions,
)
from palpate.core.policy.conversion import document_of, learner_of, new_learner, policy_from
from palpate.core.policy.entries import ActionEntry, LearnerEntry, TableRow
from palpate.core.policy.examples import ExamplesPolicy, load_examples
from palpate.core.policy.exploration import TemperatureSchedule, boltzmann, boltzmann_probabilities
from palpate.core.policy.file import SCHEMA, PolicyDocument, render_table
from palpate.core.policy.programmed import AssignedPolicy, MixedPolicy, ProgrammedPolicy, RandomWalkPolicy
from palpate.core.policy.reinforcement import ActionOutcome, ActionPenalty, InternalEffort, Reinforcement
from palpate.core.policy.sarsa import Sarsa, SarsaParameters
from palpate.core.policy.tabular import QLearning, QParameters, TabularLearner

__all__ = [
    "EXAMPLES",
    "LEARNED",
    "PROGRAMMED",
    "SCHEMA",
    "Action",
    "ActionEntry",
    "ActionOutcome",
    "ActionPenalty",
    "AssignedPolicy",
    "BackOff",
    "BackingOff",
    "Decision",
    "ExamplesPolicy",
    "FixedPolicy",
    "InternalEffort",
    "LearnerEntry",
    "MixedPolicy",
    "Observation",
    "Policy",
    "PolicyDocument",
    "ProgrammedPolicy",
    "QLearning",
    "QParameters",
    "RandomWalkPolicy",
    "Reinforcement",
    "Sarsa",
    "SarsaParameters",
    "TableRow",
    "TabularLearner",
    "TemperatureSchedule",
    "Transition",
    "boltzmann",
    "boltzmann_probabilities",
    "compass_actions",
    "document_of",
    "learner_of",
    "load_examples",
    "new_learner",
    "policy_from",
    "render_table",
]
