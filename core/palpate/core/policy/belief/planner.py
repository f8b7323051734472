"""Planner that uses a belief over the hole's position."""

from __future__ import annotations

from math import ceil, cos, hypot, pi, sin
from typing import Final

import numpy as np

from palpate.core.policy.belief.arithmetic import Floats
from palpate.core.policy.belief.places import PITCH_M, SINGLE, Places, off_path_m2

_HEADINGS: Final = 16
_LENGTHS_M: Final = (2e-4, 4e-4)
"""Step lengths in addition to the longest one, which is the distance that the tool travels in an action."""
_BLOCK: Final = 3
"""Number of cells per block row."""
_UNLIKELY: Final = 1e-4
"""Probability, relative to that of the most probable block, below which a block is ignored."""


class Planner:
    """One-step planner that minimises the expected time from the end of an unsuccessful step to the hole.

    Attributes:
        moves: Possible steps, (dx, dy) in m.
    """

    def __init__(self, places: Places, capture_m: float, speed_m: float) -> None:
        self._places, self._speed_m = places, speed_m
        self.moves: tuple[tuple[float, float], ...] = tuple(
            (length * cos(2 * pi * k / _HEADINGS), length * sin(2 * pi * k / _HEADINGS))
            for length in (*(length for length in _LENGTHS_M if length < speed_m), speed_m)
            for k in range(_HEADINGS)
        )
        self._ends = np.array(self.moves)
        reach = self._reach = ceil((speed_m + capture_m) / PITCH_M)
        x, y = np.meshgrid(*(np.arange(-reach, reach + 1) * PITCH_M,) * 2, indexing="ij")
        # Cost of a cell on the path if the peg were not captured there.
        self._saved = np.stack(
            [
                ((off_path_m2(x, y, dx, dy) <= capture_m * capture_m) * self._cost(x - dx, y - dy)).reshape(-1)
                for dx, dy in self.moves
            ]
        ).astype(SINGLE)
        blocks = -(-places.size // _BLOCK)
        # Centres of the blocks, equal for x and y; the last block may extend beyond the edge.
        self._middle_m = (np.arange(blocks) * _BLOCK + (_BLOCK - 1) / 2) * PITCH_M + float(places.axis_m[0])
        # Array for a belief with a zero margin: the length of a path, rounded up to whole blocks.
        self._margin = -(-reach // _BLOCK)
        self._room = np.zeros(((self._margin + blocks + self._margin) * _BLOCK,) * 2, SINGLE)

    def _cost(self, x_m: Floats, y_m: Floats) -> Floats:
        """Return the number of actions needed to cover a given displacement."""
        cost: Floats = 1.0 + np.sqrt(x_m * x_m + y_m * y_m) / self._speed_m
        return cost

    def best(self, belief: Floats, from_m: tuple[float, float], limit_m: float) -> tuple[tuple[float, float], float]:
        """Return the best step, (dx, dy) in m, and the expected number of actions after it.

        Args:
            belief: Probability that the hole is at each cell, (size, size).
            from_m: Tip position, (x, y) in m, task frame.
            limit_m: Maximum distance from the goal in x or y at which a step may end, unless all steps end beyond it.
        """
        # Actions from the end of each path to the centre of each block.
        ends = self._ends + np.array(from_m)
        x, y = ((self._middle_m - end).astype(SINGLE) for end in (ends[:, :1], ends[:, 1:]))
        actions = 1.0 + np.sqrt((x * x)[:, :, None] + (y * y)[:, None, :]) / self._speed_m
        edge, size = self._margin * _BLOCK, len(belief)
        self._room[edge : edge + size, edge : edge + size] = belief
        rows = self._room[edge:-edge]
        rows = _in_threes(rows.reshape(-1, _BLOCK, rows.shape[1]).swapaxes(0, 1))
        weights = _in_threes(rows[:, edge:-edge].reshape(-1, _BLOCK).T)
        weights *= weights > _UNLIKELY * weights.max()
        # The distance to a far cell is approximated by that to the centre of its block.
        far = (actions.reshape(len(self.moves), -1) * weights).sum(axis=1)
        row, column = self._places.cell(*from_m)
        outside, length = edge - self._reach, 2 * self._reach + 1
        row, column = row + outside, column + outside
        around = self._room[row : row + length, column : column + length].reshape(-1)
        expected = (far - (self._saved * around).sum(axis=1)).astype(np.float64)
        expected[np.abs(ends).max(axis=1) > limit_m] += 1e6
        best = int(expected.argmin())
        return self.moves[best], float(expected[best])


def _in_threes(rows: Floats) -> Floats:
    """Return the sum of three rows, added in a fixed order."""
    first, second, third = rows
    sums: Floats = first + second + third
    return sums


class SpiralSearch:
    """An Archimedean spiral about a point, in chords short enough to leave no gaps, then repeated between its turns.

    Args:
        step_m: Maximum step length.
        radius_m: Radius at which a spiral ends and the next one begins, because a hole may be passed without a drop.
    """

    _SAGITTA_M: Final = 3e-5
    _INCREMENT: Final = 0.05

    def __init__(self, centre_m: tuple[float, float], pitch_m: float, step_m: float, radius_m: float) -> None:
        self._centre, self._pitch_m, self._step_m, self._radius_m = centre_m, pitch_m, step_m, radius_m
        self._angle = self._phase = 0.0

    def next_m(self, from_m: tuple[float, float]) -> tuple[float, float]:
        """Return the step from the current position to the next point; the first step leads straight to the centre."""
        to_centre = self._centre[0] - from_m[0], self._centre[1] - from_m[1]
        if self._angle == 0.0:
            away = hypot(*to_centre)
            if away > self._step_m:
                return to_centre[0] * self._step_m / away, to_centre[1] * self._step_m / away
            if away > PITCH_M:
                return to_centre
        per_angle = self._pitch_m / (2 * pi)
        target = self._angle
        travelled = 0.0
        while True:
            radius = per_angle * target
            chord = min(self._step_m, 2.0 * (2.0 * max(radius, self._pitch_m) * self._SAGITTA_M) ** 0.5)
            left, per_radian = chord - travelled, hypot(radius, per_angle)
            if left <= 0.0:
                break
            if left < self._INCREMENT * per_radian:
                target += left / per_radian
                break
            travelled += self._INCREMENT * per_radian
            target += self._INCREMENT
        radius, heading = per_angle * target, target + self._phase
        self._angle = target
        if radius > self._radius_m:
            self._angle, self._phase = 0.0, self._phase + pi
        return to_centre[0] + radius * cos(heading), to_centre[1] + radius * sin(heading)
