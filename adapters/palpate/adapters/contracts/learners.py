"""Contracts for policies and learners, as test suites that ship with the package.

Three lines test your own policy; :func:`third_party` wraps it as ``palpate train --policy`` does::

    class TestDrift(LearnerContract):
        def make(self, *, frozen: bool = False) -> Learner:
            return third_party(Drift(CONTEXT), frozen=frozen)
"""

import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from math import atan2, hypot, isfinite, pi
from typing import Any, ClassVar, Final

import numpy as np

from palpate.adapters.contracts.bench import require
from palpate.core.errors import PalpateError
from palpate.core.policy import (
    Action,
    Decision,
    EpisodeOutcome,
    Learner,
    Observation,
    Policy,
    PolicyContext,
    TaskBounds,
    ThirdPartyEntry,
    ThirdPartyPolicy,
    Transition,
    compass_actions,
)
from palpate.core.ports import Vector3

CONTEXT: Final = PolicyContext(("a", "b", "c", "d"), compass_actions(0.7e-3), TaskBounds(3.5e-3, 0.05))
"""Task for the practice trials: four states, defined by the direction of the torque, and eight compass steps."""
_ACTIONS: Final = 12
"""Maximum number of actions in a practice trial, after which it ends in the hole."""
_FOUND_M: Final = 0.4e-3
_CUE_NM: Final = 0.02
_NOISE_NM: Final = 0.003
_PRESS: Final[Vector3] = (0.0, 0.0, -4.9)


def third_party(policy: Any, context: PolicyContext = CONTEXT, *, frozen: bool = False) -> ThirdPartyPolicy:
    """Wrap a policy that does not derive from a palpate class."""
    kind = type(policy)
    return ThirdPartyPolicy(
        policy, ThirdPartyEntry(f"{kind.__module__}:{kind.__name__}", "", "", "", 0), context, frozen=frozen
    )


class Practice:
    """Practice trials in which the torque points to the hole; calls are in the same order as in a real task."""

    def __init__(self, context: PolicyContext, seed: int = 0) -> None:
        self._context, self._seed = context, seed

    def begin(self, policy: Policy, trial: int) -> None:
        """Begin a trial."""
        policy.begin_trial(trial, np.random.default_rng((self._seed, trial)))

    def trials(self, policy: Policy, numbers: Iterable[int]) -> list[Decision]:
        """Run complete trials; return the decisions in order."""
        decisions = []
        for trial in numbers:
            self.begin(policy, trial)
            decisions += list(self.rest(policy, trial))
        return decisions

    def rest(self, policy: Policy, trial: int) -> Iterator[Decision]:
        """Run the rest of a trial that has begun, one action at a time."""
        world = np.random.default_rng((self._seed, trial, 1))
        (x, y), (hole_x, hole_y) = world.uniform(-2e-3, 2e-3, (2, 2)).tolist()
        for number in range(_ACTIONS):
            seen = self._seen(x, y, hole_x, hole_y, number, world)
            decision = policy.choose(seen)
            yield decision
            dx, dy = decision.action.displacement_m
            x, y = x + dx, y + dy
            found = number == _ACTIONS - 1 or hypot(hole_x - x, hole_y - y) < _FOUND_M
            if decision.index is not None:
                after = None if found else self._state(hole_x - x, hole_y - y)
                policy.learn(Transition(seen.state, decision.index, -1.0, after))
            if found:
                policy.end_trial(EpisodeOutcome(True, (hole_x, hole_y, 0.01), 0.01))
                return

    def _state(self, dx: float, dy: float) -> int:
        states = len(self._context.states)
        return min(int((atan2(dy, dx) + pi) / (2.0 * pi) * states), states - 1)

    def _seen(
        self, x: float, y: float, hole_x: float, hole_y: float, number: int, world: np.random.Generator
    ) -> Observation:
        dx, dy = hole_x - x, hole_y - y
        far = max(hypot(dx, dy), 1e-9)
        noise_x, noise_y = (_NOISE_NM * world.standard_normal(2)).tolist()
        torque = (_CUE_NM * dy / far + noise_x, -_CUE_NM * dx / far + noise_y, 0.0)
        return Observation(self._state(dx, dy), (x, y, 0.0), (x, y, 0.0), _PRESS, torque, number)


class PolicyContract(ABC):
    """Clauses for every policy; a subclass supplies the policy."""

    context: ClassVar[PolicyContext] = CONTEXT
    practice_trials: ClassVar[int] = 4
    """Number of trials per clause; increase it if the first trials of a learner are random."""

    @abstractmethod
    def make(self) -> Policy:
        """Return a new policy."""

    def practised(self, policy: Policy) -> list[Decision]:
        """Return the decisions from all practice trials."""
        return Practice(self.context).trials(policy, range(self.practice_trials))

    def test_equal_seeds_give_equal_decisions(self) -> None:
        """New policies make the same decisions in identical trials, with all randomness from the trial's generator."""
        first, second = (self.practised(self.make()) for _ in range(2))
        require("equal seeds", first == second, "other decisions", "the same decisions with the same seeds")

    def test_decision_is_one_of_action_set_or_has_no_index(self) -> None:
        """A decision is a finite step; if it has an index, it is the action with that index."""
        actions: tuple[Action, ...] = self.context.actions
        for decision in self.practised(self.make()):
            named = decision.index is None or (
                0 <= decision.index < len(actions) and actions[decision.index] == decision.action
            )
            require("index", named, f"{decision.action} with index {decision.index}", "that action of the set, or None")
            require("step", all(map(isfinite, decision.action.displacement_m)), f"{decision.action}", "finite lengths")


class LearnerContract(PolicyContract):
    """Clauses for every learner, in addition to those for policies; a subclass supplies the learner."""

    @abstractmethod
    def make(self, *, frozen: bool = False) -> Learner:
        """Return a new learner; a frozen one does not learn."""

    def learned(self) -> Learner:
        """Return a learner trained on all practice trials."""
        learner = self.make()
        self.practised(learner)
        return learner

    def test_trials_that_end_in_hole_are_counted(self) -> None:
        """Each trial that ends in the hole adds one to ``trials_learned``."""
        count = self.learned().trials_learned
        require("count", count == self.practice_trials, f"{count} trials", f"{self.practice_trials}")

    def test_equal_trials_give_equal_state(self) -> None:
        """Two learners trained on identical trials have byte-identical states."""
        first, second = (_text(self.learned().get_state()) for _ in range(2))
        require("equal bytes", first == second, "another state", "the same bytes after the same trials")

    def test_frozen_learner_learns_nothing(self) -> None:
        """The state of a frozen learner never changes."""
        learner = self.make(frozen=True)
        learner.set_state(self.learned().get_state())
        Practice(self.context).begin(learner, 0)
        before = _text(learner.get_state())
        self.practised(learner)
        require("frozen", _text(learner.get_state()) == before, "another state", "the state before the trials")

    def test_learner_resumes_from_its_state(self) -> None:
        """A learner restored from a state saved as JSON continues like the original learner."""
        learner, twin, practice = self.learned(), self.make(), Practice(self.context)
        trial = self.practice_trials
        practice.begin(learner, trial)
        twin.set_state(json.loads(_text(learner.get_state())))
        require("trials", twin.trials_learned == trial, f"{twin.trials_learned} trials", f"{trial}")
        practice.begin(twin, trial)
        for first, second in zip(practice.rest(learner, trial), practice.rest(twin, trial), strict=True):
            require("resumed", first == second, f"{second}", f"{first}, as without an interruption")
        same = _text(twin.get_state()) == _text(learner.get_state())
        require("state afterwards", same, "another one", "that of the learner that went on")

    def test_state_is_copy(self) -> None:
        """Further trials change neither the state that ``get_state`` returned nor the one passed to ``set_state``."""
        learner = self.make()
        self.practised(learner)
        given = learner.get_state()
        before = _text(given)
        self.practised(learner)
        require("given", _text(given) == before, "a state that changes", "a copy")
        learner.set_state(given)
        self.practised(learner)
        require("taken", _text(given) == before, "a state that changes", "a copy")

    def test_bad_state_is_refused_and_changes_nothing(self) -> None:
        """A state with a missing or invalid part raises one of palpate's errors and changes nothing."""
        learner = self.learned()
        before = learner.get_state()
        for broken, fault in broken_states(before):
            try:
                learner.set_state(broken)
            except PalpateError as error:
                require("one line", "\n" not in str(error), f"{error}", "one line")
            else:
                require("refusal", False, f"a state with {fault} is taken", "one of palpate's errors")
            same = _text(learner.get_state()) == _text(before)
            require("unchanged", same, f"another state after one with {fault}", "the state before")


def broken_states(state: Mapping[str, Any]) -> Iterator[tuple[dict[str, Any], str]]:
    """Yield states with one part missing or replaced, each with a description of the fault."""
    for key in state:
        yield {name: value for name, value in state.items() if name != key}, f"no {key}"
        others: tuple[Any, ...] = (None, "x", [[]])
        for value in others:
            if value != state[key]:
                yield {**state, key: value}, f"{key} = {value!r}"


def _text(state: Mapping[str, Any]) -> str:
    return json.dumps(state, allow_nan=False)
