"""A third-party policy: code that a name leads to, in a wrapper that turns whatever it does wrong into one error."""

import copy
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import isfinite
from operator import index
from typing import Annotated, Any, ClassVar, Final, Self, TypeVar

import numpy as np
from typing_extensions import override

from palpate.core.errors import ConfigurationError, PolicyError, told
from palpate.core.policy.base import Action, Decision, Hindsight, Observation, Transition
from palpate.core.policy.learner import Learner, Reach
from palpate.core.ports import Range, Settings

T = TypeVar("T")

LONGEST_CHOICE_NS: Final = 200_000_000
"""A choice on a rig that takes longer ends the trial: an arm without a command for so long is stopped anyway."""
_METHODS: Final = ("serves", "begin_trial", "choose", "learn")
_STATE: Final = {"get_state", "set_state"}


@dataclass(frozen=True, slots=True)
class PolicyContext:
    """Facts of the task that a policy may need as it is made.

    Attributes:
        actions: The action set, by its indices; ``Decision.index`` is a place in it.
        reach: Where the tip may go, and the time of an action.
    """

    states: tuple[str, ...]
    actions: tuple[Action, ...]
    reach: Reach


@dataclass(frozen=True, slots=True)
class ForeignEntry(Settings):
    """What a policy file, or a log, holds of such a policy."""

    TABLE: ClassVar[str] = "foreign"

    code: str
    """What makes it: ``package.module:Name``."""
    distribution: str
    """The package that it is from, as installed; empty for a module that belongs to none."""
    version: str
    """Version of that package."""
    source_sha256: str
    """Digest of the module's source; empty where there is none."""
    trials_learned: Annotated[int, Range(0)]
    """Number of trials that it learned in."""
    state: Mapping[str, Any] | None = None
    """What it has learned, as its ``get_state`` gives it; None where it has none."""

    def content(self) -> dict[str, Any]:
        """The state of a learner."""
        return {"trials_learned": self.trials_learned, "state": None if self.state is None else dict(self.state)}

    def unlearned(self) -> Self:
        """The same before it learned anything."""
        return replace(self, trials_learned=0, state=None)


class ForeignPolicy(Learner):
    """A policy behind the interface that it claims to have. What it raises or gives that makes no sense is its fault.

    Args:
        frozen: Keep it from learning: its ``learn`` and ``end_trial`` are not called.

    Attributes:
        learns: Whether it offers what it has learned, by ``get_state`` and ``set_state``.
        now_ns: The clock of the rig that it is at work on; None where no time passes.

    Raises:
        ConfigurationError: It lacks what a policy needs, or has no state to be put to.
        PolicyError: It refuses its state.
    """

    def __init__(self, policy: Any, entry: ForeignEntry, context: PolicyContext, *, frozen: bool) -> None:
        self._policy, self._entry, self.context, self.frozen = policy, entry, context, frozen
        self.now_ns: Callable[[], int] | None = None
        self._trials = entry.trials_learned
        self._has = self._called("being looked at", self._members)
        missing = [name for name in (*_METHODS, "temperature") if name not in self._has]
        if missing:
            kind = type(policy).__name__
            raise ConfigurationError("policy", entry.code, f"code that makes a policy; its {kind} lacks {missing[0]}")
        self.learns = self._has >= _STATE
        if entry.state is not None:
            if not self.learns:
                raise ConfigurationError(
                    "policy", entry.code, "a policy with get_state and set_state, which it had once"
                )
            self.set_state(entry.content())

    def _members(self) -> set[str]:
        names = (*_METHODS, *_STATE, "end_trial")
        methods = {name for name in names if callable(getattr(self._policy, name, None))}
        return methods | ({"temperature"} if hasattr(self._policy, "temperature") else set())

    @property
    def entry(self) -> ForeignEntry:
        """What a policy file holds of it."""
        return replace(self._entry, **self.get_state()) if self.learns else self._entry

    @property
    @override
    def temperature(self) -> float | None:
        def given() -> float | None:
            temperature = self._policy.temperature
            return None if temperature is None else _finite(temperature)

        return self._called("temperature", given)

    @override
    def serves(self, state: int) -> bool:
        return self._called("serves", lambda: bool(self._policy.serves(state)))

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        self._called("begin_trial", lambda: self._policy.begin_trial(trial, rng))

    @override
    def choose(self, observation: Observation) -> Decision:
        """Its decision, with what is not the action set's own made of plain numbers.

        Raises:
            PolicyError: It raised, gave no decision, or took too long for a rig.
        """
        began_ns = 0 if self.now_ns is None else self.now_ns()
        given: Any = self._called("choose", lambda: self._policy.choose(observation))
        took_ns = 0 if self.now_ns is None else self.now_ns() - began_ns
        if took_ns > LONGEST_CHOICE_NS:
            took = f"took {took_ns * 1e-9:.2f} s; at most {LONGEST_CHOICE_NS * 1e-9:g} s on a rig"
            raise PolicyError(self._entry.code, f"choose {took}")
        return self._called("choose", lambda: self._plain(given))

    def _plain(self, given: Any) -> Decision:
        if not isinstance(given, Decision) or not isinstance(given.action, Action):
            raise TypeError(f"{given!r:.80} is no Decision with an Action")
        action, actions = given.action, self.context.actions
        x, y = action.displacement_m
        names = (action.name, given.source)
        if not all(isinstance(name, str) and name and name.isprintable() for name in names):
            raise ValueError(f"action and source are called {names}, which no log can show")
        if given.index is None:
            return Decision(Action(action.name, (_finite(x), _finite(y)), action.spatial), None, given.source)
        place = index(given.index)
        if not 0 <= place < len(actions) or actions[place] != action:
            known = f"the action set has {len(actions)}, index None is for others"
            raise ValueError(f"{action.name!r} is not action {place}; {known}")
        return Decision(actions[place], place, given.source)

    @override
    def learn(self, transition: Transition) -> None:
        if not self.frozen:
            self._called("learn", lambda: self._policy.learn(transition))

    @override
    def end_trial(self, hindsight: Hindsight) -> None:
        if self.frozen:
            return
        if "end_trial" in self._has:
            self._called("end_trial", lambda: self._policy.end_trial(hindsight))
        self._trials += 1

    @property
    @override
    def trials_learned(self) -> int:
        return self._trials

    @override
    def get_state(self) -> dict[str, Any]:
        return {"trials_learned": self._trials, "state": self._called("get_state", self._plain_state)}

    def _plain_state(self) -> dict[str, Any]:
        # As bytes, because logs and policy files hold UTF-8.
        text = json.dumps(self._policy.get_state(), allow_nan=False, ensure_ascii=False).encode()
        plain = json.loads(text)
        if not isinstance(plain, dict):
            raise TypeError(f"{plain!r:.80} is no dict")
        return plain

    @override
    def set_state(self, state: Mapping[str, Any]) -> None:
        own, trials = copy.deepcopy(state["state"]), int(state["trials_learned"])
        self._called("set_state", lambda: self._policy.set_state(own))
        self._trials = trials

    def _called(self, name: str, call: Callable[[], T]) -> T:
        try:
            return call()
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            # Third-party code may fail in any way.
            raise PolicyError(self._entry.code, f"{name} failed with {told(error)}") from error


def _finite(value: Any) -> float:
    number = float(value)
    if not isfinite(number):
        raise ValueError(f"{number} is no finite number")
    return number
