"""Trials in a grid world, with the states, policies and learners that the insertion task has.

What :class:`~palpate.core.tasks.insertion.agent.Agent` does above a force sensor is done here above a map: a symbol,
its state, what the last action came to, the next action, in this order.
"""

from dataclasses import dataclass
from typing import Final

from palpate.core.automata import Strings
from palpate.core.errors import CommandError, ConfigurationError, require_whole
from palpate.core.perception import IdentityState, StateIdentifier
from palpate.core.policy import (
    COMPASS_NAMES,
    ActionPenalty,
    Hindsight,
    Observation,
    Policy,
    RandomWalkPolicy,
    Transition,
)
from palpate.core.ports import Vector3
from palpate.core.trial import Purpose, generator
from palpate.simulation.grid.maps import GridMap, grid_actions

STEP_LIMIT: Final = 100
"""Steps after which a trial ends without the goal (paper, section 4)."""
PENALTY: Final = ActionPenalty()
_NOWHERE: Final[Vector3] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Walk:
    """What happened in a trial.

    Attributes:
        symbols: Readings in their order, that of the start first and none at the goal; with the goal, as many as there
            were actions.
    """

    start: int
    symbols: tuple[int, ...]
    actions: tuple[int, ...]
    reached: bool

    @property
    def steps(self) -> int:
        """Number of actions."""
        return len(self.actions)


class Walker:
    """The agent in its map during one trial, move by move; the caller chooses the moves.

    Args:
        grid: The map; the agent gets nothing of it but readings.
        identifier: From readings to states; it is reset first.
        trial: Index of the trial; with the seed it gives the start.
        start: Number of the cell in which it begins; None for the one that seed and trial give.

    Attributes:
        cell: Where it is; None at the goal.
        state: The state there; at the goal, where nothing is read, that of the cell before.

    Raises:
        ConfigurationError: The identifier has other symbols than the map.
    """

    def __init__(
        self,
        grid: GridMap,
        identifier: StateIdentifier,
        seed: int,
        trial: int,
        start: int | None = None,
    ) -> None:
        if identifier.symbols != grid.symbols:
            accepted = f"the symbols of the map, {', '.join(grid.symbols)}"
            raise ConfigurationError("grid.state", identifier.symbols, accepted)
        self._grid, self._identifier = grid, identifier
        self._start = int(generator(seed, Purpose.START, trial).integers(len(grid.cells))) if start is None else start
        self._symbols, self._actions = [grid.readings[self._start]], list[int]()
        identifier.reset()
        self.cell: int | None = self._start
        self.state = identifier.update(self._symbols[0])

    @property
    def symbol(self) -> int:
        """The last reading."""
        return self._symbols[-1]

    @property
    def steps(self) -> int:
        """Number of moves so far."""
        return len(self._actions)

    @property
    def walk(self) -> Walk:
        """What happened so far."""
        return Walk(self._start, tuple(self._symbols), tuple(self._actions), reached=self.cell is None)

    def observation(self) -> Observation:
        """What a policy chooses by: nothing but the state is known, no position and no force."""
        return Observation(self.state, _NOWHERE, _NOWHERE, _NOWHERE, _NOWHERE, self.steps)

    def move(self, action: int) -> int | None:
        """Make a move; returns the next state, None at the goal.

        Raises:
            CommandError: The goal is reached already.
        """
        if self.cell is None:
            raise CommandError("at the goal there is no move", action)
        self._actions.append(action)
        self.cell = self._grid.moves[self.cell][action]
        if self.cell is None:
            return None
        self._symbols.append(self._grid.readings[self.cell])
        self.state = self._identifier.update(self._symbols[-1], COMPASS_NAMES[action])
        return self.state


def run_trial(
    grid: GridMap,
    identifier: StateIdentifier,
    policy: Policy,
    seed: int,
    trial: int,
    *,
    step_limit: int = STEP_LIMIT,
    start: int | None = None,
) -> Walk:
    """One trial from a random cell to the goal, or to the limit.

    The policy learns in the ordinary way: a trial that is cut off ends with an ordinary transition. What it came to is
    told as in the insertion task, but of a place nothing is known.

    Args:
        grid: The map; the agent gets nothing of it but readings.
        trial: Index of the trial; with the seed it gives the start and the policy's random numbers.
        start: Number of the cell in which it begins; None for the one that seed and trial give.

    Raises:
        ConfigurationError: The identifier has other symbols than the map, or the limit is below 1.
        CommandError: The policy chose something that is not of the action set.
    """
    require_whole("grid.step_limit", step_limit, 1, 10_000_000)
    walker = Walker(grid, identifier, seed, trial, start)
    policy.begin_trial(trial, generator(seed, Purpose.POLICY, trial))
    for _ in range(step_limit):
        observation = walker.observation()
        decision = policy.choose(observation)
        if decision.index is None:
            raise CommandError("in a grid an action must be one of the set", decision.action.name)
        next_state = walker.move(decision.index)
        policy.learn(Transition(observation.state, decision.index, PENALTY.per_action, next_state))
        if next_state is None:
            break
    policy.end_trial(Hindsight(walker.walk.reached, _NOWHERE, 0.0))
    return walker.walk


def walks_from_all_cells(
    grid: GridMap,
    identifier: StateIdentifier,
    policy: Policy,
    *,
    step_limit: int = STEP_LIMIT,
    walks: int = 1,
    seed: int = 0,
) -> list[Walk]:
    """Trials from every cell, as many from each: what a frozen policy costs.

    With one walk a cell the mean is exact where the policy leaves nothing to chance.

    Args:
        policy: A frozen one.
    """
    return [
        run_trial(grid, identifier, policy, seed, trial, step_limit=step_limit, start=trial // walks)
        for trial in range(walks * len(grid.cells))
    ]


def walk_strings(grid: GridMap, count: int, seed: int, longest: int = STEP_LIMIT) -> Strings:
    """Readings of random walks that ended at the goal, the start's first; the goal itself has none.

    The walks are trials 0, 1, 2, ... of :func:`run_trial` under a random policy; those
    that have not reached the goal after ``longest`` steps are left out, and the next trial takes their place. Files of
    such strings are those of :mod:`palpate.core.automata.strings`.

    Args:
        count: How many strings, from 1.
        seed: Gives the walks, which have nothing in common with learning runs of the same seed.
        longest: Most symbols of a string, which is the most steps of a walk.

    Raises:
        ConfigurationError: A number is out of its range, or the walks show a single symbol only.
    """
    require_whole("walks", count, 1, 10_000_000)
    require_whole("longest", longest, 1, 10_000_000)
    identifier, policy = IdentityState(grid.symbols), RandomWalkPolicy(grid_actions())
    own_seed = int(generator(seed, Purpose.WALKS, 0).integers(2**63))
    walks: list[Walk] = []
    trial = 0
    while len(walks) < count:
        walk = run_trial(grid, identifier, policy, own_seed, trial, step_limit=longest)
        trial += 1
        if walk.reached:
            walks.append(walk)
    return Strings(grid.symbols, tuple(walk.symbols for walk in walks))
