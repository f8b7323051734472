"""Trials in a grid world, with the states, policies and learners that the insertion task has.

What :class:`~palpate.core.explorer.Explorer` does above a force sensor is done here above a map: a symbol, its state,
what the last action came to, the next action, in this order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from palpate.core.checks import require_whole
from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception import StateIdentifier
from palpate.core.policy import ActionPenalty, Observation, Policy, Transition
from palpate.core.randomness import Purpose, generator
from palpate.core.values import Vector3
from palpate.simulation.grid.maps import GridMap

STEP_LIMIT: Final = 100
"""Steps after which a trial ends without the goal (paper, section 4)."""
PENALTY: Final = ActionPenalty()
_NOWHERE: Final[Vector3] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Walk:
    """What happened in a trial.

    Attributes:
        start: Cell in which it began.
        symbols: Readings in their order, that of the start first and none at the goal; with the goal, as many as there
            were actions.
        actions: Places in the action set.
        reached: Whether the last action led to the goal.
    """

    start: int
    symbols: tuple[int, ...]
    actions: tuple[int, ...]
    reached: bool

    @property
    def steps(self) -> int:
        """Number of actions."""
        return len(self.actions)


def run_trial(
    grid: GridMap,
    identifier: StateIdentifier,
    policy: Policy,
    seed: int,
    trial: int,
    *,
    step_limit: int = STEP_LIMIT,
    penalty: ActionPenalty = PENALTY,
) -> Walk:
    """One trial from a random cell to the goal, or to the limit.

    The policy learns by what it was told: a trial that is cut off ends with an ordinary transition.

    Args:
        grid: The map; the agent gets nothing of it but readings.
        identifier: From readings to states.
        policy: Chooses and learns; its actions are :func:`~palpate.simulation.grid.maps.grid_actions`.
        seed: The run's seed.
        trial: Index of the trial; with the seed it gives the start and the policy's random numbers.
        step_limit: Most actions.
        penalty: What each action costs.

    Raises:
        ConfigurationError: The identifier knows other symbols than the map has, or the limit is below 1.
        CommandError: The policy chose something that is not of the action set.
    """
    require_whole("grid.step_limit", step_limit, 1, 10_000_000)
    if identifier.symbols != grid.symbols:
        raise ConfigurationError("grid.state", identifier.symbols, f"the symbols of the map, {', '.join(grid.symbols)}")
    start = int(generator(seed, Purpose.START, trial).integers(len(grid.cells)))
    policy.begin_trial(trial, generator(seed, Purpose.POLICY, trial))
    identifier.reset()
    symbols, actions = [grid.readings[start]], []
    cell, state = start, identifier.update(symbols[0])
    for number in range(step_limit):
        # Nothing else is known to the agent: no position, no force.
        decision = policy.choose(Observation(state, _NOWHERE, _NOWHERE, _NOWHERE, _NOWHERE, number))
        if decision.index is None:
            raise CommandError("in a grid an action must be one of the set", decision.action.name)
        actions.append(decision.index)
        target = grid.moves[cell][decision.index]
        if target is None:
            policy.learn(Transition(state, decision.index, penalty.per_action, None))
            return Walk(start, tuple(symbols), tuple(actions), reached=True)
        reading = grid.readings[target]
        next_state = identifier.update(reading)
        policy.learn(Transition(state, decision.index, penalty.per_action, next_state))
        symbols.append(reading)
        cell, state = target, next_state
    return Walk(start, tuple(symbols), tuple(actions), reached=False)
