"""What an agent sees of the insertion task: the core's state, or what the core makes it from."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Final, Protocol

import numpy as np
from gymnasium import spaces

from palpate.adapters.composition import wander_m
from palpate.adapters.config import RunConfig
from palpate.core.insertion import InsertionTask

KINDS: Final = ("symbolic", "raw")
_MARGIN_M: Final = 2e-3
"""Springs and rims: the tip may be measured so far beside the place to which it was led."""
_SEARCH_M: Final = 10e-3
"""The approach looks for the surface no deeper than this below the depth of the hole."""


class Observations(Protocol):
    """An observation space, and what is seen after a tick of the task.

    Attributes:
        space: The observation space.
    """

    space: spaces.Space[Any]

    @abstractmethod
    def of(self, task: InsertionTask) -> Any:
        """What is seen now; new data every time."""


class StateIndex(Observations):
    """The number of the state that the core has perceived, as its learners have it.

    In the hole nothing is perceived any more: the state is the last one before.

    Args:
        states: How many states there are.
    """

    def __init__(self, states: int) -> None:
        self.space = spaces.Discrete(states)

    def of(self, task: InsertionTask) -> np.int64:
        """The state."""
        return np.int64(0 if task.percept is None else task.percept[1])


class TipWrench(Observations):
    """Tip and wrench, (9,), task frame: x y z in m from the nominal goal, force in N, torque about the tip in N m.

    It is what the core makes its symbols from: tip by the encoders, z into the hole; wrench tared, filtered, moved to
    the tip. Bounds: the exploration area and 2 mm; from above the ready height to below the hole; the force limit, and
    the torque of that force at the peg's rim. What is beyond is cut off there.

    Args:
        config: The run's configuration.
    """

    def __init__(self, config: RunConfig) -> None:
        task = config.task
        # The start may lie beside the centre of the area, but never farther out than its corner.
        across = wander_m(config) + _MARGIN_M
        up, down = task.ready_height_mm * 1e-3 + _MARGIN_M, task.insertion_depth_mm * 1e-3 + _SEARCH_M
        force, torque = task.max_force_N, task.max_force_N * config.cell.peg.diameter_mm * 0.5e-3
        high = np.array([across, across, down, *[force] * 3, *[torque] * 3], np.float32)
        low = -high
        low[2] = -up
        self.space = spaces.Box(low, high, dtype=np.float32)
        self._low, self._high = low, high

    def of(self, task: InsertionTask) -> np.ndarray[Any, np.dtype[np.float32]]:
        """The nine numbers."""
        force, torque = task.wrench_at_tip
        seen = np.array([*task.tip_m, *force, *torque], np.float32)
        return np.clip(seen, self._low, self._high)
