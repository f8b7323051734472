"""``palpate/SensorMap-v0``: the grid worlds with ambiguous sensors, one move a step."""

from typing import Any, Final

import gymnasium
import numpy as np
from gymnasium import spaces

from palpate.adapters.experiments.grid import SYMBOLS, Named, grid_named
from palpate.adapters.gymnasium_envs.episode import NotRunningError, refuse_unknown
from palpate.adapters.gymnasium_envs.peg_insertion import Numbering
from palpate.adapters.gymnasium_envs.spaces import index_of
from palpate.core.errors import ConfigurationError, require_whole
from palpate.simulation.grid import COMPASS, GOAL, PENALTY, STEP_LIMIT, Walker

_NAME: Final = "palpate/SensorMap-v0"
_ARGUMENTS: Final = ("map", "size", "state", "step_limit")


class SensorMapEnv(gymnasium.Env[np.int64, np.int64]):
    """A grid world as an environment: the agent reads the sensor value of its cell, which other cells share.

    Observation: the number of the state. At the goal nothing is read: the state is the last one before. Actions: the
    eight compass moves, in the order of the insertion task; against a wall the agent stays. Reward: -1 a move.
    Terminated: at the goal. Truncated: at the step limit.

    The episodes after ``reset(seed=s)`` are the trials 0, 1, 2, ... of palpate's own runs with that seed;
    ``options={"trial": k}`` goes to one.

    Args:
        map: A scenario (``1``, ``2`` or ``twin``), eight regions such as ``ABC/C.E/BDF``, or a text file.
        size: Length of a side in cells, odd, where the map is made of regions.
        state: ``symbols``: the last reading; ``last-2``, ``last-3``: the last readings; or an automaton file.

    Raises:
        ConfigurationError: An argument is unknown or refused.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - Gymnasium declares it so

    def __init__(
        self,
        map: str = "1",
        size: int = 7,
        state: str = SYMBOLS,
        step_limit: int = STEP_LIMIT,
        render_mode: str | None = None,
        **unknown: object,
    ) -> None:
        refuse_unknown(_NAME, unknown, _ARGUMENTS)
        if render_mode is not None:
            raise ConfigurationError("render_mode", render_mode, "None: this environment draws no pictures")
        for name, value in (("map", map), ("state", state)):
            if not isinstance(value, str):
                raise ConfigurationError(name, value, "a text")
        require_whole("step_limit", step_limit, 1, 1_000_000)
        self.render_mode = None
        self.grid = grid_named(map, size)
        self.identifier = Named(state)(self.grid)
        self._limit, self._distances = step_limit, self.grid.distances
        self._goal = next((row.index(GOAL), y) for y, row in enumerate(self.grid.rows) if GOAL in row)
        self._walker: Walker | None = None
        self._numbering, self._run = Numbering(), (0, 0)
        self.observation_space = spaces.Discrete(len(self.identifier.states))
        self.action_space = spaces.Discrete(len(COMPASS))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.int64, dict[str, Any]]:
        """Put the agent into the cell in which the next trial starts.

        Args:
            seed: Seed of this trial and those that follow; None goes on with the seed that there is.
            options: ``{"trial": k}`` runs the trial of that index; anything else is refused.

        Raises:
            ConfigurationError: An option is unknown or refused.
        """
        super().reset(seed=seed)
        run_seed, trial = self._run = self._numbering.next(seed, options, self.np_random)
        self._walker = walker = Walker(self.grid, self.identifier, run_seed, trial)
        self._numbering.passed(trial)
        return np.int64(walker.state), self._info(walker)

    def step(self, action: Any) -> tuple[np.int64, float, bool, bool, dict[str, Any]]:
        """One move.

        Raises:
            ActionRefusedError: There is no such action; nothing was done.
            NotRunningError: No episode runs.
        """
        walker = self._walker
        if walker is None:
            raise NotRunningError("no episode runs; call reset() before the first step, and after an episode has ended")
        walker.move(index_of(action, len(COMPASS)))
        reached = walker.cell is None
        truncated = not reached and walker.steps >= self._limit
        if reached or truncated:
            self._walker = None
        return np.int64(walker.state), PENALTY.per_action, reached, truncated, self._info(walker)

    def _info(self, walker: Walker) -> dict[str, Any]:
        """What an agent may not learn from: it would give its place away."""
        column, row = self._goal if walker.cell is None else self.grid.cells[walker.cell]
        return {
            "seed": self._run[0],
            "trial": self._run[1],
            "steps": walker.steps,
            "is_success": walker.cell is None,
            "symbol": self.grid.symbols[walker.symbol],
            "state": self.identifier.states[walker.state],
            "column": column,
            "row": row,
            "distance": self._distances[walker.cell],
        }
