"""From a live policy to its document and back."""

from collections.abc import Mapping, Sequence
from typing import Any

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import EXAMPLES, LEARNED, PROGRAMMED, Action, Policy
from palpate.core.policy.belief import BeliefLearner
from palpate.core.policy.entries import ActionEntry, LearnerEntry, TableRow
from palpate.core.policy.examples import ExamplesPolicy
from palpate.core.policy.file import PolicyDocument
from palpate.core.policy.foreign import ForeignPolicy
from palpate.core.policy.hmm import HmmLearner
from palpate.core.policy.learner import Learner
from palpate.core.policy.model_entry import BeliefEntry, HmmEntry, Reach
from palpate.core.policy.programmed import AssignedPolicy, MixedPolicy, ProgrammedPolicy
from palpate.core.policy.sarsa import Sarsa, SarsaParameters
from palpate.core.policy.tabular import QLearning, QParameters, TabularLearner


def learner_of(policy: Policy) -> Learner | None:
    """The learner that a policy is or has as a part; the first one."""
    if isinstance(policy, ForeignPolicy):
        return policy if policy.learns else None
    return next((part for part in _parts_of(policy) if isinstance(part, Learner)), None)


def document_of(policy: Policy, *, created_with: Mapping[str, Any], perception: Mapping[str, Any]) -> PolicyDocument:
    """The content of a policy, ready to be saved.

    Args:
        policy: Programmed, examples, Q-learning, Sarsa, a belief or a model of hidden states, or a mixture of these;
            the last two only behind a part, be it empty, that has names for states and actions. Or a foreign policy.

    Raises:
        ConfigurationError: It is of another kind, or has no action for some state.
    """
    if isinstance(policy, ForeignPolicy):
        return PolicyDocument(
            created_with=created_with,
            perception=perception,
            states=policy.context.states,
            actions=tuple(ActionEntry.of(action) for action in policy.context.actions),
            table=(),
            learner=None,
            foreign=policy.entry,
        )
    parts: list[AssignedPolicy | TabularLearner] = []
    models = [part for part in _parts_of(policy) if isinstance(part, BeliefLearner | HmmLearner)]
    for part in _parts_of(policy):
        if isinstance(part, BeliefLearner | HmmLearner) and len(_parts_of(policy)) > 1:
            continue
        if not isinstance(part, AssignedPolicy | TabularLearner):
            accepted = (
                "programmed, examples, Q-learning, Sarsa, mixed a belief or an HMM; nothing else fits a policy file"
            )
            raise ConfigurationError("policy", type(part).__name__, accepted)
        parts.append(part)
    learner = next((part for part in parts if isinstance(part, TabularLearner)), None)
    states, actions = parts[0].states, parts[0].actions
    if any(part.states != states or part.actions != actions for part in parts):
        raise ConfigurationError("policy", "parts that differ", "the same states and actions in all its parts")
    if sum(isinstance(part, Learner) for part in (*parts, *models)) > 1:
        raise ConfigurationError("policy", "several learners", "at most one learner")
    return PolicyDocument(
        created_with=created_with,
        perception=perception,
        states=states,
        actions=tuple(ActionEntry.of(action) for action in actions),
        table=tuple(
            _row_of(state, parts, learner)
            for state in range(len(states))
            if not models or any(part.serves(state) for part in parts)
        ),
        learner=None if learner is None else LearnerEntry(learner.parameters, learner.trials_learned),
        belief=next((BeliefEntry.of(one) for one in models if isinstance(one, BeliefLearner)), None),
        hmm=next((HmmEntry.of(one) for one in models if isinstance(one, HmmLearner)), None),
    )


def policy_from(
    document: PolicyDocument,
    states: Sequence[str],
    actions: Sequence[Action],
    *,
    frozen: bool = True,
    reach: Reach | None = None,
) -> Policy:
    """The policy of a document, for a task with these states and actions.

    The actions are the task's own: those of the file are rounded to mm, which could cost the last bit. Unless
    ``frozen``, learning resumes; the next trial is number ``document.learner.trials_learned`` if the temperature is to
    go on where it was. A belief needs ``reach``, which is the task's own, too.

    Raises:
        ConfigurationError: The task has other states or actions, it is not known what a belief has to cover, or the
            policy is foreign: then its code has to be loaded.
    """
    document.check_matches(states, actions)
    if document.foreign is not None:
        raise ConfigurationError("policy.foreign", document.foreign.code, "a policy that is made by code of palpate's")
    pairs = {
        source: [(row.state, row.action) for row in document.table if row.source == source]
        for source in (PROGRAMMED, EXAMPLES)
    }
    parts: list[Policy] = []
    # Beside a model it may be empty: it names states and actions, without which the policy cannot be written again.
    if pairs[PROGRAMMED] or document.model is not None:
        parts.append(ProgrammedPolicy(states, actions, dict(pairs[PROGRAMMED])))
    if pairs[EXAMPLES]:
        parts.append(ExamplesPolicy(states, actions, pairs[EXAMPLES]))
    if document.learner is not None:
        learner, learned = new_learner(document.learner.parameters, states, actions, frozen=frozen), document.values()
        learner.set_state(learner.get_state() | learned | {"trials_learned": document.learner.trials_learned})
        parts.append(learner)
    if document.belief is not None:
        if reach is None:
            raise ConfigurationError("policy.belief", None, "the area and the time of an action of a task")
        parts.append(document.belief.learner(reach, frozen=frozen))
    if document.hmm is not None:
        parts.append(document.hmm.learner(states, actions, frozen=frozen))
    return parts[0] if len(parts) == 1 else MixedPolicy(states, parts)


def _parts_of(policy: Policy) -> tuple[Policy, ...]:
    return policy.parts if isinstance(policy, MixedPolicy) else (policy,)


def _row_of(state: int, parts: Sequence[AssignedPolicy | TabularLearner], learner: TabularLearner | None) -> TableRow:
    owner = next((part for part in parts if part.serves(state)), None)
    name = parts[0].states[state]
    q = None if learner is None else learner.q[state]
    if isinstance(owner, TabularLearner):
        values = owner.q[state]
        source, best = LEARNED, values.index(max(values))
    else:
        assigned = None if owner is None else owner.assigned(state)
        if owner is None or assigned is None:
            raise ConfigurationError("policy", f"no action for {name!r}", "an action for every state")
        source, best = owner.source, assigned
    visits = None if learner is None else learner.visits[state]
    return TableRow.of(name, source, parts[0].actions[best].name, best, q, visits)


def new_learner(
    parameters: QParameters, states: Sequence[str], actions: Sequence[Action], *, frozen: bool = False
) -> TabularLearner:
    """Make the learner that has such settings: Sarsa(lambda) or Q-learning.

    Raises:
        ConfigurationError: A value is out of its range, or names repeat.
    """
    if isinstance(parameters, SarsaParameters):
        return Sarsa(states, actions, parameters, frozen=frozen)
    return QLearning(states, actions, parameters, frozen=frozen)
