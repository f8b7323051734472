"""The learner that models hidden states behind symbols, from what was read and done in whole trials."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Final, Protocol, Self

import numpy as np
from typing_extensions import override

from palpate.core.policy.base import (
    LEARNED,
    Action,
    Decision,
    Hindsight,
    Observation,
    Transition,
    check_names,
    drawing_from,
)
from palpate.core.policy.memory.automaton_model import fit_automata, units_of_each
from palpate.core.policy.memory.belief import HiddenWorld, StateBelief
from palpate.core.policy.memory.clone_fit import fit_clones
from palpate.core.policy.memory.finite_pomdp import require_room
from palpate.core.policy.memory.offset_model import fit_offsets, lattice_steps
from palpate.core.policy.memory.point_based import Plan
from palpate.core.policy.memory.recorded import RecordedTrial
from palpate.core.policy.model_learner import ModelLearner
from palpate.core.ports import OneOf, Range, Settings, require_keys

OFFSET: Final = "offset"
CLONES: Final = "clones"
AUTOMATON: Final = "automaton"
REFITS: Final = {
    OFFSET: (30, 60, 100, 150, 220, 300, 400, 500),
    CLONES: (100, 250, 500),
    AUTOMATON: (100, 250, 500),
}
"""Of each kind of model the numbers of trials after which it is fitted anew; then after every half more. Until the
first of them actions are random."""

PATIENCE: Final = 20
"""After so many actions in a trial the belief is doubted: a growing share is random, at four times as many all."""

_ROUND: Final = 5 * PATIENCE
"""Actions after which the plan is trusted anew: from elsewhere it may lead to the goal, which chance alone may miss."""

_WEARY: Final = {OFFSET: 0.0, CLONES: 0.5, AUTOMATON: 0.5}
"""Steps that an action is held to cost more for each time that it was taken before in this trial after the same two
readings: models that nothing ties to a plane lead round in circles where they are wrong."""


class WorldModel(Protocol):
    """A fitted model, of whatever kind."""

    def pomdp(self) -> HiddenWorld:
        """The same as a world with hidden states."""

    def plan(self) -> Plan:
        """How to reach the goal in it; it follows from the model."""

    def log_loss(self, trials: Sequence[RecordedTrial]) -> float:
        """Nats a reading that these trials cost under it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryParameters(Settings):
    """Settings of the learner that models hidden states."""

    TABLE: ClassVar[str] = "learning.memory"
    UNTOLD: ClassVar[Mapping[str, Any]] = MappingProxyType(
        {"lattice": 0, "first_kept": False, "merging": False, "misreading": False, "commuting": False}
    )

    kind: Annotated[str, OneOf(*REFITS)] = OFFSET
    """offset: hidden states are offsets from the goal, and the displacement of each action is known; clones: each
    belongs to one symbol, and no more is known; automaton: they are states of automata, of recurrent networks."""
    reach: Annotated[int, Range(1, 200)] = 10
    """Of the kind offset: the largest offset along x or y that is thought of, in steps."""
    lattice: Annotated[int, Range(0, 20)] = 0
    """Of the kind offset: the longest displacement along x or y is taken for so many steps, and all others are rounded
    to whole ones; 0: all have to be whole multiples of the shortest."""
    exploration: Annotated[float, Range(0.0, 1.0)] = 0.1
    """Share of random actions once there is a model; before, all are."""
    memory_trials: Annotated[int, Range(10, 100_000)] = 1000
    """So many trials a model is fitted to, at most."""
    first_kept: bool = True
    """Half of these are the first trials, whose actions were random or poor yet, rather than all the last: those avoid
    what the plan avoids, and alone they would let a model forget it."""
    merging: bool = True
    """Of the kind clones: where moves fail, hidden states of one place are merged and those of several divided, if
    held-out trials are foretold the better for it."""
    misreading: bool = True
    """Of the kind clones: where readings are wrong, the share of those that are is learned, and hidden states of one
    place are merged and those of several divided, if held-out trials are foretold the better for it."""
    commuting: bool = True
    """Of the kind clones: where trials show that actions undo each other and commute, their displacements are learned,
    and hidden states begin as offsets from the goal, if held-out trials are foretold the better for it."""


def fitted_after(kind: str, trials: int) -> int:
    """Number of trials that the model in use was fitted to, after so many trials; 0 for none."""
    last = max((due for due in REFITS[kind] if due <= trials), default=0)
    while last >= REFITS[kind][-1] and last + last // 2 <= trials:
        last += last // 2
    return last


class MemoryLearner(ModelLearner[RecordedTrial]):
    """Learns hidden states from pairs of actions and symbols, and acts by a plan on its belief over them.

    The first trials are random. A model is fitted after :data:`REFITS` trials, from scratch: so it follows from the
    trials alone. Of several models each has a belief of its own, and they are weighed by how likely each held the
    readings of this trial.

    Args:
        symbols: Names of the symbols; these are the states that it is asked in.
        frozen: Learn nothing more, and leave nothing to chance within the first :data:`PATIENCE` actions of a trial.

    Raises:
        ConfigurationError: Names repeat, actions that are on no lattice, a model that would be too large, or for an
            automaton one symbol alone.
    """

    def __init__(
        self, symbols: Sequence[str], actions: Sequence[Action], parameters: MemoryParameters, *, frozen: bool = False
    ) -> None:
        check_names(symbols, actions)
        super().__init__(frozen=frozen)
        self.states, self.actions, self.parameters = tuple(symbols), tuple(actions), parameters
        if parameters.kind == OFFSET:
            self._steps = lattice_steps(actions, parameters.lattice)
            require_room("reach", (2 * parameters.reach + 1) ** 2 - 1, len(actions))
        if parameters.kind == AUTOMATON:
            units_of_each(len(symbols))
        self._fitted = 0
        self._plans: tuple[Plan, ...] = ()
        self.models: tuple[WorldModel, ...] = ()
        self._rng: np.random.Generator | None = None
        self._forget()

    @property
    def trials(self) -> tuple[RecordedTrial, ...]:
        """What was read and done in every trial that it learned from."""
        return tuple(self._trials)

    def as_frozen(self) -> Self:
        """A learner that acts by the models as they are, and changes nothing."""
        self._refit()
        other = type(self)(self.states, self.actions, self.parameters, frozen=True)
        other.use(self.models, self._trials, self._plans)
        return other

    def use(self, models: Sequence[WorldModel], trials: Sequence[RecordedTrial], plans: tuple[Plan, ...] = ()) -> None:
        """Act by these models, which were fitted to these trials; plans are made when they are needed, if not here."""
        self._trials, self._fitted_to, self._trials_learned = list(trials), list(trials), len(trials)
        self._fitted = fitted_after(self.parameters.kind, len(trials))
        self.models, self._plans = tuple(models), plans

    @override
    def _fit(self) -> None:
        due = fitted_after(self.parameters.kind, len(self._trials))
        if due == self._fitted:
            return
        self.use(self._models_of(self._fitting(due), due), self._trials)

    def _fitting(self, due: int) -> list[RecordedTrial]:
        """What of the first so many trials a model is fitted to."""
        most = min(due, self.parameters.memory_trials)
        first = most // 2 if self.parameters.first_kept else 0
        return self._trials[:first] + self._trials[due - most + first : due]

    def _models_of(self, trials: Sequence[RecordedTrial], seed: int) -> tuple[WorldModel, ...]:
        if self.parameters.kind == CLONES:
            settings = self.parameters
            return fit_clones(
                trials,
                len(self.states),
                len(self.actions),
                seed=seed,
                merging=settings.merging,
                misreading=settings.misreading,
                commuting=settings.commuting,
            )
        if self.parameters.kind == AUTOMATON:
            return fit_automata(trials, len(self.states), len(self.actions), seed=seed)
        return (fit_offsets(trials, self._steps, self.parameters.reach, len(self.states), seed=seed),)

    @override
    def _begin(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._plans = self._plans or tuple(model.plan() for model in self.models)
        self._forget()

    def _forget(self) -> None:
        self._symbols: list[int] = []
        self._actions: list[int] = []
        self._next: int | None = None
        self._beliefs: tuple[StateBelief, ...] = ()
        self._weights = np.ones(len(self._plans))
        self._taken: Counter[tuple[tuple[int, ...], int]] = Counter()

    @override
    def choose(self, observation: Observation) -> Decision:
        """The action that the plan takes for the cheapest, or a random one.

        Raises:
            LifecycleError: No trial has begun, and the action is left to chance.
        """
        self._take_in(observation.state)
        index, recent = self._explored(), (*self._symbols[-2:], *self._actions[-1:])
        if index is None:
            weights = self._weights
            costs = [w * p.costs(b.probabilities) for w, p, b in zip(weights, self._plans, self._beliefs, strict=True)]
            vain = [_WEARY[self.parameters.kind] * self._taken[recent, action] for action in range(len(self.actions))]
            index = int((np.array(costs).sum(axis=0) + vain).argmin()) if costs else 0
        self._taken[recent, index] += 1
        return Decision(self.actions[index], index, LEARNED)

    def _take_in(self, symbol: int) -> None:
        self._symbols.append(symbol)
        if not self._actions:
            self._beliefs = tuple(StateBelief(plan.model, symbol) for plan in self._plans)
        else:
            for belief in self._beliefs:
                belief.update(self._actions[-1], symbol)
        if self._plans:
            weights = self._weights * [belief.likelihood for belief in self._beliefs]
            self._weights = weights / weights.sum()

    def _explored(self) -> int | None:
        """A random action, in the share of cases that is left to chance."""
        done = len(self._actions) % _ROUND
        doubted = done >= PATIENCE
        if self.frozen and self._plans and not doubted:
            return None
        rng = drawing_from(self._rng, type(self).__name__)
        draw, index = rng.random(), int(rng.integers(len(self.actions)))
        share = done / (4 * PATIENCE) if doubted else self.parameters.exploration
        share = share if self._plans else 1.0
        return index if draw < share else None

    @override
    def learn(self, transition: Transition) -> None:
        if len(self._symbols) == len(self._actions):  # another part of the policy chose
            self._take_in(transition.state)
        self._actions.append(transition.action_index)
        self._next = transition.next_state

    @override
    def end_trial(self, hindsight: Hindsight) -> None:
        if self.frozen or not self._actions:
            return
        # What an action came to that was still running when the trial was cut off is not told.
        symbols = self._symbols[: len(self._actions)] + ([] if self._next is None else [self._next])
        self._remember(RecordedTrial(tuple(symbols), tuple(self._actions), self._next is None))

    @override
    def set_state(self, state: Mapping[str, Any]) -> None:
        require_keys("learner", state, ("trials", "trials_learned"))
        sizes = len(self.states), len(self.actions)
        trials = [
            RecordedTrial.from_dict(f"learner.trials[{k}]", data, *sizes) for k, data in enumerate(state["trials"])
        ]
        kept = fitted_after(self.parameters.kind, len(trials)) == self._fitted
        if not kept or trials[: self._fitted] != self._trials[: self._fitted]:
            self._fitted, self.models, self._plans = 0, (), ()
        self._trials, self._trials_learned, self._fitted_to = trials, int(state["trials_learned"]), None
