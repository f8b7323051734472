"""Learner that fits a hidden-state model to the symbols and actions from whole trials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Final

import numpy as np
from typing_extensions import override

from palpate.core.policy.base import (
    LEARNED,
    Action,
    Decision,
    EpisodeOutcome,
    Observation,
    Transition,
    check_names,
    drawing_from,
)
from palpate.core.policy.hmm.baum_welch import RecordedTrial
from palpate.core.policy.hmm.displacement_hmm import DisplacementHmm, fit_displacement_hmm, lattice_steps
from palpate.core.policy.hmm.point_based import PointBasedPlan, StateBelief, require_room
from palpate.core.policy.learner import ModelLearner
from palpate.core.ports import Range, Settings

REFITS: Final = (30, 60, 100, 150, 220, 300, 400, 500)
"""Trial counts after which the model is fitted; later fits follow each time the number has grown by half. All
actions are random before the first fit."""

GREEDY_ACTIONS: Final = 20
"""Number of actions in a trial after which a growing fraction of actions is random; from four times this number on, all
are random."""

_ROUND: Final = 5 * GREEDY_ACTIONS
"""Number of actions after which this count restarts and the plan is used again; by then the offset has changed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HmmParameters(Settings):
    """Settings for the learner whose hidden states are offsets from the goal, in steps."""

    TABLE: ClassVar[str] = "learning.hmm"

    reach: Annotated[int, Range(1, 200)] = 10
    """Maximum offset from the goal along x or y, in steps."""
    lattice: Annotated[int, Range(0, 20)] = 0
    """Number of steps in the longest displacement along x or y; all displacements are rounded to whole steps. If 0, all
    must be integer multiples of the shortest."""
    exploration: Annotated[float, Range(0.0, 1.0)] = 0.1
    """Fraction of random actions once there is a model; before that, all actions are random."""
    memory_trials: Annotated[int, Range(10, 100_000)] = 1000
    """Maximum number of trials to fit the model to: half of them the first, half the latest. The latest trials alone
    lack the situations that the plan avoids."""


def fitted_after(trials: int) -> int:
    """Return the number of trials after which the model was last fitted; 0 if there is no model yet."""
    last = max((due for due in REFITS if due <= trials), default=0)
    while last >= REFITS[-1] and last + last // 2 <= trials:
        last += last // 2
    return last


class HmmLearner(ModelLearner[RecordedTrial]):
    """Learner that fits a hidden Markov model to actions and symbols, and acts on a plan over its belief.

    The first trials are random. The model is fitted from scratch at the trial counts in :data:`REFITS`, so it depends
    only on the trials.

    Args:
        symbols: Symbol names, which are the states in its observations.
        frozen: True disables learning, and also random actions in the first :data:`GREEDY_ACTIONS` actions of a trial.

    Raises:
        ConfigurationError: A name is repeated, the actions have no common lattice, or the model would be too large.
    """

    def __init__(
        self, symbols: Sequence[str], actions: Sequence[Action], parameters: HmmParameters, *, frozen: bool = False
    ) -> None:
        check_names(symbols, actions)
        super().__init__(frozen=frozen)
        self.states, self.actions, self.parameters = tuple(symbols), tuple(actions), parameters
        self._steps = lattice_steps(actions, parameters.lattice)
        require_room("reach", (2 * parameters.reach + 1) ** 2 - 1, len(actions))
        self._fitted = 0
        self._plan: PointBasedPlan | None = None
        self.model: DisplacementHmm | None = None
        self._rng: np.random.Generator | None = None
        self._forget()

    @property
    def trials(self) -> tuple[RecordedTrial, ...]:
        """Readings and actions from every trial from which the learner has learned."""
        return tuple(self._trials)

    def use(self, model: DisplacementHmm, trials: Sequence[RecordedTrial]) -> None:
        """Use a model fitted to the given trials; the plan is computed at the start of the next trial."""
        self._trials, self._fitted_to, self._trials_learned = list(trials), list(trials), len(trials)
        self._fitted = fitted_after(len(trials))
        self.model, self._plan = model, None

    def _fit(self) -> None:
        due = fitted_after(len(self._trials))
        if due == self._fitted:
            return
        most = min(due, self.parameters.memory_trials)
        first = most // 2
        trials = self._trials[:first] + self._trials[due - most + first : due]
        model = fit_displacement_hmm(trials, self._steps, self.parameters.reach, len(self.states), seed=due)
        self.use(model, self._trials)

    def _begin(self, rng: np.random.Generator) -> None:
        self._rng = rng
        if self._plan is None and self.model is not None:
            self._plan = self.model.plan()
        self._forget()

    def _forget(self) -> None:
        self._symbols: list[int] = []
        self._actions: list[int] = []
        self._next: int | None = None
        self._belief: StateBelief | None = None

    def choose(self, observation: Observation) -> Decision:
        """Return the action with the lowest cost under the plan, or a random action."""
        self._take_in(observation.state)
        index, share = self._planned(), self._random_share()
        if index is None or share > 0.0:
            rng = drawing_from(self._rng, type(self).__name__)
            draw, random = rng.random(), int(rng.integers(len(self.actions)))
            if index is None or draw < share:
                index = random
        return Decision(self.actions[index], index, LEARNED)

    def _planned(self) -> int | None:
        """Return the action with the lowest cost under the plan, or None if there is no plan yet."""
        if self._plan is None or self._belief is None:
            return None
        return int(self._plan.costs(self._belief.probabilities).argmin())

    def _random_share(self) -> float:
        """Return the fraction of random actions while there is a plan."""
        done = len(self._actions) % _ROUND
        if done >= GREEDY_ACTIONS:
            return done / (4 * GREEDY_ACTIONS)
        return 0.0 if self.frozen else self.parameters.exploration

    def _take_in(self, symbol: int) -> None:
        self._symbols.append(symbol)
        if self._plan is None:
            return
        if self._belief is None or not self._actions:
            self._belief = StateBelief(self._plan.model, symbol)
        else:
            self._belief.update(self._actions[-1], symbol)

    @override
    def learn(self, transition: Transition) -> None:
        if len(self._symbols) == len(self._actions):  # another part of the policy chose
            self._take_in(transition.state)
        self._actions.append(transition.action_index)
        self._next = transition.next_state

    @override
    def end_trial(self, episode: EpisodeOutcome) -> None:
        if self.frozen or not self._actions:
            return
        # The result of an action that the end of the trial interrupted is unknown.
        symbols = self._symbols[: len(self._actions)] + ([] if self._next is None else [self._next])
        self._remember(RecordedTrial(tuple(symbols), tuple(self._actions), self._next is None))

    @override
    def set_state(self, state: Mapping[str, Any]) -> None:
        before = self._trials[: self._fitted]
        super().set_state(state)
        if fitted_after(len(self._trials)) != self._fitted or self._trials[: self._fitted] != before:
            self._fitted, self.model, self._plan = 0, None, None
        self._fitted_to = None

    def _trial_from(self, where: str, data: object) -> RecordedTrial:
        return RecordedTrial.from_dict(where, data, len(self.states), len(self.actions))
