"""Trials in a grid world, with the insertion task's states, policies and learners.

The agent works on a map as :class:`~palpate.core.tasks.insertion.agent.Agent` works with a force sensor: it reads a
symbol, updates the state, learns from the last action, and chooses the next one.
"""

from dataclasses import dataclass
from typing import Final

from palpate.core.automata import Strings
from palpate.core.errors import CommandError, ConfigurationError, require_whole
from palpate.core.perception import IdentityState, StateIdentifier
from palpate.core.policy import (
    COMPASS_NAMES,
    ActionPenalty,
    EpisodeOutcome,
    Observation,
    Policy,
    RandomWalkPolicy,
    Transition,
)
from palpate.core.ports import Vector3
from palpate.core.trial import Purpose, generator
from palpate.simulation.grid.maps import GridMap, grid_actions

STEP_LIMIT: Final = 100
"""Number of steps after which a trial ends without reaching the goal (paper, section 4)."""
PENALTY: Final = ActionPenalty()
_NOWHERE: Final[Vector3] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Walk:
    """A trial's path, with the readings in order from the start. The goal has no reading."""

    start: int
    symbols: tuple[int, ...]
    actions: tuple[int, ...]
    reached: bool

    @property
    def steps(self) -> int:
        """Number of actions."""
        return len(self.actions)


class Walker:
    """The agent on its map during one trial; the caller chooses the moves.

    Args:
        trial: Index of the trial; with the seed it determines the start.
        start: Index of the first cell; if None, the seed and the trial determine it.

    Attributes:
        cell: Current cell, or None at the goal.
        state: State in the current cell. The goal has no reading and keeps the state from the previous cell.

    Raises:
        ConfigurationError: The identifier and the map have different symbols.
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
        """The trial so far."""
        return Walk(self._start, tuple(self._symbols), tuple(self._actions), reached=self.cell is None)

    def observation(self) -> Observation:
        """Return the observation for the policy, which contains only the state: positions and forces are zero."""
        return Observation(self.state, _NOWHERE, _NOWHERE, _NOWHERE, _NOWHERE, self.steps)

    def move(self, action: int) -> int | None:
        """Make a move and return the next state, or None at the goal.

        Raises:
            CommandError: The goal has already been reached.
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
    """Run one trial from a random cell to the goal or the step limit.

    The policy learns as usual: a truncated trial ends with an ordinary transition. The policy receives the outcome as
    in the insertion task, but without a position.

    Raises:
        ConfigurationError: The identifier and the map have different symbols, or the limit is below 1.
        CommandError: The policy chose an action outside the action set.
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
    policy.end_trial(EpisodeOutcome(walker.walk.reached, _NOWHERE, 0.0))
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
    """Run the same number of trials from every cell to measure the cost of a frozen policy.

    With one walk per cell, the mean is exact if the policy is deterministic.

    Args:
        policy: A frozen policy.
    """
    return [
        run_trial(grid, identifier, policy, seed, trial, step_limit=step_limit, start=trial // walks)
        for trial in range(walks * len(grid.cells))
    ]


def walk_strings(grid: GridMap, count: int, seed: int, longest: int = STEP_LIMIT) -> Strings:
    """Return the readings of random walks that ended at the goal, from the start to the last cell before the goal.

    The walks are trials 0, 1, 2, ... of :func:`run_trial` with a random policy. A trial that has not reached the goal
    after ``longest`` steps is replaced by the next. :mod:`palpate.core.automata.strings` describes the strings.

    Args:
        longest: Maximum number of symbols in a string, and of steps in a walk.

    Raises:
        ConfigurationError: A number is out of range, or the walks contain only a single symbol.
    """
    require_whole("walks", count, 1, 10_000_000)
    require_whole("longest", longest, 1, 10_000_000)
    identifier, policy = IdentityState(grid.symbols), RandomWalkPolicy(grid_actions())
    own_seed = int(generator(seed, Purpose.RANDOM_WALKS, 0).integers(2**63))
    walks: list[Walk] = []
    trial = 0
    while len(walks) < count:
        walk = run_trial(grid, identifier, policy, own_seed, trial, step_limit=longest)
        trial += 1
        if walk.reached:
            walks.append(walk)
    return Strings(grid.symbols, tuple(walk.symbols for walk in walks))
