"""Wrapper around a third-party policy that converts its errors to PolicyError."""

import copy
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import isfinite
from operator import index
from typing import Annotated, Any, ClassVar, Final

import numpy as np
from typing_extensions import override

from palpate.core.errors import ConfigurationError, PolicyError, describe
from palpate.core.policy.base import Action, Decision, EpisodeOutcome, Observation, Transition
from palpate.core.policy.learner import Learner, TaskBounds
from palpate.core.ports import Range, Settings

LONGEST_CHOICE_NS: Final = 200_000_000
"""Maximum time for a choice on a rig; after that, the trial ends. The set-point time-out would stop the arm anyway."""
_METHODS: Final = ("serves", "begin_trial", "choose", "learn")


@dataclass(frozen=True, slots=True)
class PolicyContext:
    """Information about the task, passed to a policy's constructor.

    Attributes:
        actions: The action set; ``Decision.index`` is an index into it.
        bounds: Bounds on the hole and tip positions, and the longest step in an action.
    """

    states: tuple[str, ...]
    actions: tuple[Action, ...]
    bounds: TaskBounds


@dataclass(frozen=True, slots=True)
class ThirdPartyEntry(Settings):
    """Record of a third-party policy in a policy file or a log."""

    TABLE: ClassVar[str] = "third_party"

    code: str
    """Class or factory: ``package.module:Name``."""
    distribution: str
    """Installed package that contains the code; empty for a module outside any package."""
    version: str
    """That package's version."""
    source_sha256: str
    """SHA-256 digest of the module's source; empty if there is none."""
    trials_learned: Annotated[int, Range(0)]
    """Number of trials from which it learned."""
    state: Mapping[str, Any] | None = None
    """Learned state from ``get_state``; None if the policy has none."""


class ThirdPartyPolicy(Learner):
    """A third-party policy, with or without a state.

    Args:
        frozen: True disables learning: ``learn`` and ``end_trial`` are not called.

    Attributes:
        learns: True if the policy has ``get_state`` and ``set_state``.
        now_ns: The rig's clock, used to limit the time for a choice.

    Raises:
        ConfigurationError: The policy lacks a required method.
        PolicyError: The policy rejects its state.
    """

    def __init__(self, policy: Any, entry: ThirdPartyEntry, context: PolicyContext, *, frozen: bool) -> None:
        self._policy, self._entry, self.context, self.frozen = policy, entry, context, frozen
        self.now_ns: Callable[[], int] = lambda: 0
        self._trials_learned = entry.trials_learned
        missing = [name for name in _METHODS if not self._has(name)]
        if missing:
            kind = type(policy).__name__
            raise ConfigurationError("policy", entry.code, f"no policy: its {kind} lacks {missing[0]}")
        self.learns = self._has("get_state") and self._has("set_state")
        if entry.state is not None:
            self.set_state({"trials_learned": entry.trials_learned, "state": entry.state})

    @property
    def entry(self) -> ThirdPartyEntry:
        """Return the record for a policy file."""
        return replace(self._entry, **self.get_state()) if self.learns else self._entry

    @property
    @override
    def temperature(self) -> float | None:
        with self._named("temperature"):
            return _finite(getattr(self._policy, "temperature", None))

    @override
    def serves(self, state: int) -> bool:
        with self._named("serves"):
            return bool(self._policy.serves(state))

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        with self._named("begin_trial"):
            self._policy.begin_trial(trial, rng)

    def choose(self, observation: Observation) -> Decision:
        """Return the decision in plain numbers; raise PolicyError for an error, an invalid or a late decision."""
        began_ns = self.now_ns()
        with self._named("choose"):
            decision = self._plain(self._policy.choose(observation))
        took_ns = self.now_ns() - began_ns
        if took_ns > LONGEST_CHOICE_NS:
            took = f"took {took_ns * 1e-9:.2f} s; at most {LONGEST_CHOICE_NS * 1e-9:g} s on a rig"
            raise PolicyError(self._entry.code, f"choose {took}")
        return decision

    def _plain(self, given: Any) -> Decision:
        action, actions = given.action, self.context.actions
        if not (action.name + given.source).isprintable():
            raise ValueError(f"no log can show the action {action.name!r} from {given.source!r}")
        if given.index is None:
            x, y = action.displacement_m
            return Decision(Action(action.name, (float(x), float(y)), action.spatial), None, given.source)
        place = index(given.index)
        if not 0 <= place < len(actions) or actions[place] != action:
            known = f"the action set has {len(actions)}, index None is for others"
            raise ValueError(f"{action.name!r} is not action {place}; {known}")
        return Decision(actions[place], place, given.source)

    @override
    def learn(self, transition: Transition) -> None:
        if self.frozen:
            return
        with self._named("learn"):
            self._policy.learn(transition)

    @override
    def end_trial(self, episode: EpisodeOutcome) -> None:
        if self.frozen:
            return
        if self._has("end_trial"):
            with self._named("end_trial"):
                self._policy.end_trial(episode)
        self._trials_learned += 1

    @override
    def get_state(self) -> dict[str, Any]:
        with self._named("get_state"):
            # As bytes, because logs and policy files hold UTF-8.
            text = json.dumps(dict(self._policy.get_state()), allow_nan=False, ensure_ascii=False).encode()
            return {"trials_learned": self._trials_learned, "state": json.loads(text)}

    @override
    def set_state(self, state: Mapping[str, Any]) -> None:
        with self._named("set_state"):
            trials = int(state["trials_learned"])
            self._policy.set_state(copy.deepcopy(dict(state["state"])))
        self._trials_learned = trials

    def _has(self, name: str) -> bool:
        return callable(getattr(self._policy, name, None))

    @contextmanager
    def _named(self, name: str) -> Iterator[None]:
        try:
            yield
        except (Exception, SystemExit) as error:
            raise PolicyError(self._entry.code, f"{name} failed with {describe(error)}") from error


def _finite(value: Any) -> float | None:
    number = None if value is None else float(value)
    if number is not None and not isfinite(number):
        raise ValueError(f"{number} is no finite number")
    return number
