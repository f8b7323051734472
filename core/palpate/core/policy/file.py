"""The policy file, which holds a policy in human-readable form, exact to the last bit.

It is JSON with schema id ``palpate.policy/4``. It specifies for each state whether a programmed action, an example, or
the learner acts, and contains the learner's settings and state.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, ClassVar, Final

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import EXAMPLES, LEARNED, PROGRAMMED, Action, Policy
from palpate.core.policy.belief import BeliefLearner
from palpate.core.policy.entries import ActionEntry, LearnerEntry, OwnLearner, TableRow, new_learner
from palpate.core.policy.examples import ExamplesPolicy
from palpate.core.policy.learner import ANY_BOUNDS, Learner, TaskBounds
from palpate.core.policy.programmed import AssignedPolicy, MixedPolicy, ProgrammedPolicy
from palpate.core.policy.third_party import ThirdPartyEntry, ThirdPartyPolicy
from palpate.core.ports import OneOf, Settings, parse_json, require_names

SCHEMA: Final = "palpate.policy/4"
POLICY_FILE: Final = "policy file"


@dataclass(frozen=True, slots=True, kw_only=True)
class PolicyDocument(Settings):
    """The contents of a policy file."""

    TABLE: ClassVar[str] = POLICY_FILE

    schema: Annotated[str, OneOf(SCHEMA)] = SCHEMA
    """File format id."""
    created_with: Mapping[str, Any]
    """Versions of the software that wrote the file, for information only."""
    perception: Mapping[str, Any]
    """Settings for the perception that maps sensor data to these states; not interpreted here."""
    states: tuple[str, ...]
    """State names."""
    actions: tuple[ActionEntry, ...]
    """The action set."""
    programmed: dict[str, str]
    """Programmed action for each state that has one."""
    examples: dict[str, str]
    """Action from examples for each state that has one."""
    learner: LearnerEntry | None = None
    """The learner for the other states; None if there is none."""
    third_party: ThirdPartyEntry | None = None
    """The third-party policy for all states, instead of the above; None if there is none."""

    def __post_init__(self) -> None:
        Settings.__post_init__(self)
        # Copied in the form that the file will return, so that the caller cannot change it.
        for name in ("created_with", "perception"):
            object.__setattr__(self, name, _plain(name, getattr(self, name)))

    @override
    def check(self) -> None:
        if self.third_party is not None:
            if self.learner is not None or self.programmed or self.examples:
                raise ConfigurationError(
                    "third_party", self.third_party.code, "nothing in addition to a third-party policy"
                )
        elif self.learner is None:
            missing = [state for state in self.states if state not in self.programmed and state not in self.examples]
            if missing:
                raise ConfigurationError("programmed", f"no action for {missing[0]!r}", "an action for every state")

    @property
    def table(self) -> tuple[TableRow, ...]:
        """Return the action for each state, except for states of a learner without a Q table."""
        learned = {} if self.learner is None else self.learner.state
        names, rows = [action.name for action in self.actions], []
        for number, state in enumerate(self.states):
            q = tuple(learned["q"][number]) if "q" in learned else None
            visits = tuple(learned["visits"][number]) if "q" in learned else None
            for source, assigned in ((PROGRAMMED, self.programmed), (EXAMPLES, self.examples)):
                if state in assigned:
                    rows.append(TableRow(state, source, assigned[state], names.index(assigned[state]), q, visits))
                    break
            else:
                if q is not None:
                    best = q.index(max(q))
                    rows.append(TableRow(state, LEARNED, names[best], best, q, visits))
        return tuple(rows)

    @property
    def reads_states(self) -> bool:
        """Return True if choices depend on the state; a belief alone uses only lever arms."""
        return bool(self.learner is None or self.learner.kind != "belief" or self.programmed or self.examples)

    def to_json_text(self) -> str:
        """Return the file's text; floats are written so that they are read back exactly."""
        return json.dumps(asdict(self), indent=1, allow_nan=False) + "\n"

    @classmethod
    def from_json_text(cls, text: str) -> PolicyDocument:
        """Parse a file's text.

        Raises:
            ConfigurationError: The text is not a policy file with this schema, or is inconsistent.
        """
        read = cls.read(parse_json(text, POLICY_FILE, SCHEMA))
        require_names("states", read.states)
        require_names("actions", [action.name for action in read.actions])
        if read.third_party is None:
            policy_from(read, read.states, [action.step() for action in read.actions], check=False)
        return read

    def unlearned(self) -> PolicyDocument:
        """Return the same policy with its initial values, before any learning."""
        if self.third_party is not None:
            return replace(self, third_party=replace(self.third_party, trials_learned=0, state=None))
        if self.learner is None:
            return self
        blank = new_learner(self.learner.parameters, self.states, [action.step() for action in self.actions])
        return replace(self, learner=LearnerEntry.of(blank))

    def check_matches(self, states: Sequence[str], actions: Sequence[Action]) -> None:
        """Reject a task with different states or actions.

        Raises:
            ConfigurationError: The message gives the first difference.
        """
        _check_same_names("states", self.states, states)
        _check_same_names("actions", [mine.name for mine in self.actions], [action.name for action in actions])
        for number, (mine, action) in enumerate(zip(self.actions, actions, strict=True)):
            mine.require_same(f"actions[{number}]", ActionEntry.of(action))


def _check_same_names(field: str, mine: Sequence[str], theirs: Sequence[str]) -> None:
    for number, (name, wanted) in enumerate(zip(mine, theirs, strict=False)):
        if name != wanted:
            raise ConfigurationError(f"{field}[{number}]", name, f"{wanted!r}, as in this task")
    if len(mine) != len(theirs):
        raise ConfigurationError(field, f"{len(mine)} of them", f"{len(theirs)} of them, as in this task")


def _plain(where: str, value: Mapping[str, Any]) -> Any:
    """Return a copy of a value as if it had been read from a JSON file."""
    try:
        return json.loads(json.dumps(dict(value), allow_nan=False))
    except (TypeError, ValueError, RecursionError) as error:
        raise ConfigurationError(where, value, f"values that JSON can express ({error})") from error


def learner_of(policy: Policy) -> Learner | None:
    """Return the first learner in a policy, or None if there is none."""
    if isinstance(policy, ThirdPartyPolicy):
        return policy if policy.learns else None
    return next((part for part in _parts_of(policy) if isinstance(part, Learner)), None)


def document_of(policy: Policy, *, created_with: Mapping[str, Any], perception: Mapping[str, Any]) -> PolicyDocument:
    """Return a policy's contents, ready to be saved.

    Args:
        policy: A programmed policy, examples, a learner, a mixture of these, or a third-party policy. A belief needs
            another part, which may be empty, for the state and action names.

    Raises:
        ConfigurationError: The policy is of a different kind, or a state has no action.
    """
    parts = _parts_of(policy)
    assigned = [part for part in parts if isinstance(part, AssignedPolicy)]
    learners = [part for part in parts if isinstance(part, OwnLearner)]
    third_party = policy if isinstance(policy, ThirdPartyPolicy) else None
    named: list[Any] = [*assigned, *(one for one in learners if not isinstance(one, BeliefLearner))]
    if third_party is not None:
        named = [third_party.context]
    elif len(assigned) + len(learners) < len(parts) or not named:
        accepted = "programmed, examples, a learner, or a mixture of these; nothing else fits a policy file"
        raise ConfigurationError("policy", ", ".join(type(part).__name__ for part in parts), accepted)
    states, actions = named[0].states, named[0].actions
    if any(part.states != states or part.actions != actions for part in named):
        raise ConfigurationError("policy", "parts that differ", "one whose parts have the same states and actions")
    if len(learners) > 1:
        raise ConfigurationError("policy", "several learners", "at most one learner")
    return PolicyDocument(
        created_with=created_with,
        perception=perception,
        states=states,
        actions=tuple(ActionEntry.of(action) for action in actions),
        programmed=_assigned(assigned, PROGRAMMED),
        examples=_assigned(assigned, EXAMPLES),
        learner=LearnerEntry.of(learners[0]) if learners else None,
        third_party=None if third_party is None else third_party.entry,
    )


def policy_from(
    document: PolicyDocument,
    states: Sequence[str],
    actions: Sequence[Action],
    bounds: TaskBounds = ANY_BOUNDS,
    *,
    frozen: bool = True,
    check: bool = True,
) -> Policy:
    """Create the policy stored in a document for a task with the given states and actions.

    The actions are the task's own, because those in the file are rounded to mm. Unless ``frozen``, learning resumes; to
    continue the temperature schedule, the next trial must be numbered ``document.learner.trials_learned``.

    Args:
        bounds: Task bounds for a belief learner.
        check: True rejects different states or actions.

    Raises:
        ConfigurationError: The states or actions differ from the task's, or the policy is a third-party one, whose code
            must be loaded.
    """
    if check:
        document.check_matches(states, actions)
    if document.third_party is not None:
        raise ConfigurationError(
            "policy.third_party", document.third_party.code, "a policy that is made by code of palpate's"
        )
    learner = document.learner
    parts: list[Policy] = []
    # Before a belief it may be empty: it provides the names of states and actions for writing the policy again.
    if document.programmed or (learner is not None and learner.kind == "belief"):
        parts.append(ProgrammedPolicy(states, actions, document.programmed))
    if document.examples:
        parts.append(ExamplesPolicy(states, actions, document.examples.items()))
    if learner is not None:
        parts.append(learner.learner(states, actions, bounds, frozen=frozen))
    return parts[0] if len(parts) == 1 else MixedPolicy(states, parts)


def _parts_of(policy: Policy) -> tuple[Policy, ...]:
    return policy.parts if isinstance(policy, MixedPolicy) else (policy,)


def _assigned(parts: Sequence[AssignedPolicy], source: str) -> dict[str, str]:
    """Return the actions that the parts with a given source assign, by state name."""
    return {
        state: part.actions[index].name
        for part in parts
        if part.source == source
        for number, state in enumerate(part.states)
        if (index := part.assigned(number)) is not None
    }
