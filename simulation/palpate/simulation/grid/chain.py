"""What a fixed policy costs exactly, and the best policy that has no memory.

Map, state identifier and policy make one absorbing Markov chain over cells and memories, solved as a linear system.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isclose
from typing import Any, Final, TypeAlias

import numpy as np
from scipy.sparse import csc_array, eye_array
from scipy.sparse.linalg import MatrixRankWarning, spsolve

from palpate.core.automata import AutomatonState
from palpate.core.errors import ConfigurationError, require_whole
from palpate.core.perception import StateIdentifier
from palpate.core.policy import COMPASS_NAMES, Policy, boltzmann_probabilities
from palpate.simulation.grid.maps import COMPASS, GridMap
from palpate.simulation.grid.trial import STEP_LIMIT, UNDISTURBED, Disturbance, run_trial

ENDLESS: Final = 1e9
"""Means above this count as infinite. The condition of the linear system is about the largest mean from any place, so
above it few digits would be right."""

MOST_PLACES: Final = 200_000
"""Most pairs of cell and memory; a memory that grows for ever must not fill the computer's."""

_Node: TypeAlias = tuple[int, int, tuple[float, ...]]
"""A cell, the state there, and the memory of the identifier."""


@dataclass(frozen=True, slots=True)
class ExpectedSteps:
    """Steps to the goal, from a uniformly random start.

    Attributes:
        steps: Mean without a limit; infinite if some start may lead round in circles for ever, or as good as for ever
            (:data:`ENDLESS`).
        limited_steps: Mean where a trial is cut off at the limit.
    """

    steps: float
    reaches: float
    limited_steps: float
    reaches_in_time: float


def greedy(q: Sequence[Sequence[float]]) -> tuple[tuple[float, ...], ...]:
    """The greedy policy of a table of values, (states, actions); best actions that are equally good share it."""
    return tuple(tuple(boltzmann_probabilities(values, 0.0)) for values in q)


def uniform(states: int) -> tuple[tuple[float, ...], ...]:
    """The random walk: every action as likely as any other, (states, 8)."""
    return ((1.0 / len(COMPASS),) * len(COMPASS),) * states


def expected_steps(
    grid: GridMap,
    identifier: StateIdentifier,
    policy: Sequence[Sequence[float]],
    step_limit: int = STEP_LIMIT,
) -> ExpectedSteps:
    """Exact mean number of steps of a policy that does not learn.

    Args:
        identifier: From readings to states; its memory is changed.
        policy: Probability of each action in each state, (states, 8).

    Raises:
        ConfigurationError: The policy does not fit the states, a row of it is no distribution, or the identifier has
            other symbols.
    """
    require_whole("grid.step_limit", step_limit, 1, 10_000_000)
    _check(grid, identifier, policy)
    chain, starts, to_goal = _chain(grid, identifier, policy)
    weights = np.bincount(starts, minlength=chain.shape[0]) / len(starts)
    able = _backward(chain, to_goal > 0.0)
    # A node from which one that never ends can be met has no finite mean.
    sure = ~_backward(chain, ~able)
    reaches = np.clip(np.nan_to_num(_solve(chain, able, to_goal)), 0.0, 1.0)
    steps = _solve(chain, sure, np.ones(len(to_goal)))
    leaks = bool((weights[~sure] > 0.0).any())
    # Not "any above": what cannot be solved is not a number.
    endless = leaks or not bool(((steps >= 0.0) & (steps < ENDLESS)).all())
    here, limited = weights, 0.0
    for _ in range(step_limit):
        limited += float(here.sum())
        here = here @ chain
    return ExpectedSteps(
        steps=inf if endless else float(weights @ steps),
        reaches=float(weights @ reaches) if leaks else 1.0,
        limited_steps=limited,
        reaches_in_time=1.0 - float(here.sum()),
    )


def walked_steps(
    grid: GridMap,
    identifier: StateIdentifier,
    policy: Policy,
    step_limit: int = STEP_LIMIT,
    *,
    walks: int = 1,
    sure_steps: int = 0,
    seed: int = 0,
    disturbance: Disturbance = UNDISTURBED,
) -> ExpectedSteps:
    """Mean number of steps of a policy that does not learn, walked from every cell.

    With one walk a cell it is exact where neither the policy nor the world leaves anything to chance.

    Args:
        policy: A frozen one.
        step_limit: Steps after which a trial is cut off; the mean without a limit takes it for endless after ten times
            as many.
        walks: From each cell.
        sure_steps: Steps in which nothing is left to chance: a cell from which the goal is reached in them is walked
            from once, for all.
    """
    longest = 10 * step_limit
    steps: list[float] = []
    for start in range(len(grid.cells)):
        for number in range(walks):
            trial = start * walks + number
            walk = run_trial(
                grid, identifier, policy, seed, trial, step_limit=longest, start=start, disturbance=disturbance
            )
            if walk.reached and walk.steps <= sure_steps:
                steps += [walk.steps] * walks
                break
            steps.append(walk.steps if walk.reached else inf)
    return _summed(steps, step_limit)


def _summed(steps: Sequence[float], step_limit: int) -> ExpectedSteps:
    count = len(steps)
    return ExpectedSteps(
        steps=sum(steps) / count,
        reaches=sum(number < inf for number in steps) / count,
        limited_steps=sum(min(number, step_limit) for number in steps) / count,
        reaches_in_time=sum(number <= step_limit for number in steps) / count,
    )


def _check(grid: GridMap, identifier: StateIdentifier, policy: Sequence[Sequence[float]]) -> None:
    if identifier.symbols != grid.symbols:
        raise ConfigurationError("grid.state", identifier.symbols, f"the symbols of the map, {', '.join(grid.symbols)}")
    if len(policy) != len(identifier.states):
        raise ConfigurationError("grid.policy", f"{len(policy)} rows", f"{len(identifier.states)}, one a state")
    for row in policy:
        if len(row) != len(COMPASS) or min(row) < 0.0 or not isclose(sum(row), 1.0):
            raise ConfigurationError("grid.policy", tuple(row), f"{len(COMPASS)} probabilities that sum to 1")


def _chain(grid: GridMap, identifier: StateIdentifier, policy: Sequence[Sequence[float]]) -> tuple[Any, Any, Any]:
    """Transition matrix over what can occur, the node of each start, and the probability of the goal at each node."""
    numbers: dict[_Node, int] = {}
    nodes: list[_Node] = []

    def number(cell: int, action: str | None = None) -> int:
        state = identifier.update(grid.readings[cell], action)
        memory = tuple(identifier.get_state())
        # An automaton counts how often it was lost; that is for people and changes nothing.
        place = (cell, state, memory[:2] if isinstance(identifier, AutomatonState) else memory)
        if place not in numbers:
            if len(nodes) == MOST_PLACES:
                accepted = f"states with a memory that is in at most {MOST_PLACES} places of the map"
                raise ConfigurationError("grid.state", type(identifier).__name__, accepted)
            numbers[place] = len(nodes)
            nodes.append((cell, state, memory))
        return numbers[place]

    starts = []
    for cell in range(len(grid.cells)):
        identifier.reset()
        starts.append(number(cell))
    rows, columns, shares, to_goal = [], [], [], []
    for source, (cell, state, memory) in enumerate(nodes):  # grows on the way
        to_goal.append(0.0)
        for target, share, action in zip(grid.moves[cell], policy[state], COMPASS_NAMES, strict=True):
            if share == 0.0:
                continue
            if target is None:
                to_goal[source] += share
                continue
            identifier.set_state(memory)
            rows.append(source)
            columns.append(number(target, action))
            shares.append(share)
    chain = csc_array((shares, (rows, columns)), shape=(len(nodes), len(nodes)))
    return chain, np.array(starts), np.array(to_goal)


def _backward(chain: Any, targets: Any) -> Any:
    """Nodes from which one of the targets can be met, the targets included."""
    found = targets
    while True:
        more = found | ((chain @ found.astype(float)) > 0.0)
        if (more == found).all():
            return found
        found = more


def _solve(chain: Any, inside: Any, gains: Any) -> Any:
    """Solution of x = gains + chain x on the nodes inside; 0 elsewhere."""
    result = np.zeros(len(gains))
    if inside.any():
        part = chain[inside][:, inside]
        with warnings.catch_warnings():
            # Where leaving takes a rounding error's probability the system is singular, and the answer no number.
            warnings.simplefilter("ignore", MatrixRankWarning)
            result[inside] = spsolve((eye_array(part.shape[0], format="csc") - part).tocsc(), gains[inside])
    return result
