"""The fit of a simulated cell to what was felt in recorded trials."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf, sqrt
from typing import Final

import numpy as np
import numpy.typing as npt

from palpate.adapters.replay.gap_cell import (
    BEFORE_TICKS,
    FREE_TICKS,
    KNOBS,
    LATE,
    PLATE,
    SETTLED,
    Array,
    Driven,
    drive,
    late,
    tip_depth_mm,
)
from palpate.core.errors import UndeterminedError
from palpate.core.ports import CONTROL_RATE_HZ

TOUCH_TICKS: Final = 20
"""A touch is over after so many."""
_PRESSING_N: Final = 0.5
_ALONG: Final = (2,)
_ACROSS: Final = (0, 1)
_FRICTIONS: Final = (0.35, 0.5, 0.7, 0.8, 0.9, 1.1, 1.25, 1.5, 1.8, 2.2)
_DELAYS: Final = (-1.0, -0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0)
"""In control ticks: between two of them, a touch that comes later looks much like a plate that is lower."""
_ROUNDS: Final = 12
_PASSES: Final = 2
_DONE: Final = 1e-3
_ROBUST: Final = 4.0


class CellFit:
    """Gauss-Newton with damping over all trials; far residuals count less, because a stick is no slip."""

    def __init__(self, trials: Sequence[Driven], gone_through: Callable[[], object]) -> None:
        self._trials, self._gone_through = trials, gone_through
        self._traces: dict[tuple[float | None, ...], list[tuple[Array, Array]]] = {}
        self.noise = self._noise()
        self.values = np.array([trials[0].config.cell.peg.friction, 1.0, 1.0,
                                trials[0].config.cell.compliance.damping_ratio, 0.0, 0.0])  # fmt: skip

    def traces(self, values: Array, ticks: int | None = None) -> list[tuple[Array, Array]]:
        """Of each trial; simulated once for each setting of the cell."""
        key = (ticks, *values[:LATE].tolist())
        if key not in self._traces:
            if len(self._traces) > len(KNOBS):
                self._traces.clear()
            self._traces[key] = [drive(trial, values, ticks) for trial in self._trials]
        return self._traces[key]

    def residual(self, values: Array, axes: Sequence[int]) -> Array:
        """Recorded minus simulated wrenches of all trials over the noise, along these axes, (m,)."""
        # What the force along the tool says of the touch is clean before the peg wanders over the hole's edge.
        ticks = FREE_TICKS + TOUCH_TICKS if axes == _ALONG else None
        rows = []
        for trial, (wrench, _) in zip(self._trials, self.traces(values, ticks), strict=True):
            rest = (trial.wrench[:ticks] - late(wrench, float(values[LATE])))[SETTLED.start :] / self.noise
            rows.append(rest[~np.isnan(rest[:, 0])][:, axes].ravel())
        return np.concatenate(rows)

    def run(self) -> Array:
        """Find the best values; returns their standard deviations.

        Stiffness, damping, plate and delay are asked of the force along the tool as it touches, friction and stiffness
        across of those across: torques say nearly the same, and shake more.
        """
        self._begin()
        sds = self._stage((1, PLATE, LATE), _ALONG)
        self.values[2] = self.values[1]
        for _ in range(_PASSES):
            sds = np.minimum(sds, self._stage((1, 3, PLATE, LATE), _ALONG))
            self._best_delay()
            self._best_friction()
            sds = np.minimum(sds, self._stage((0, 2), _ACROSS))
        return sds

    def _stage(self, fitted: Sequence[int], axes: Sequence[int]) -> Array:
        knobs = np.array(fitted)
        damping, rest = 1e-2, self.residual(self.values, axes)
        sds = np.full(len(KNOBS), inf)
        for _ in range(_ROUNDS):
            jacobian = self._jacobian(rest, knobs, axes)
            weight = 1.0 / (1.0 + (rest / _ROBUST) ** 2)
            normal = (jacobian * weight[:, None]).T @ jacobian
            slope = (jacobian * weight[:, None]).T @ rest
            excess = float(np.average(rest**2, weights=weight))
            sds[knobs] = np.sqrt(np.diag(np.linalg.pinv(normal)) * max(excess, 1.0))
            moved = False
            for _ in range(5):
                tried = self.values.copy()
                tried[knobs] -= np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-12), slope)
                tried = np.array([np.clip(v, k.low, k.high) for v, k in zip(tried, KNOBS, strict=True)])
                rest_there = self.residual(tried, axes)
                if _cost(rest_there) < _cost(rest):
                    moved = _cost(rest) - _cost(rest_there) > _DONE * _cost(rest)
                    self.values, rest, damping = tried, rest_there, damping * 0.3
                    break
                damping *= 5.0
            self._gone_through()
            if not moved:
                break
        return sds

    def _begin(self) -> None:
        """Stiffness, plate and delay to start from: a spring whose length is what the encoders show."""
        best = inf
        for delay in np.arange(0.0, 10.0, 0.5):
            depths, forces = [], []
            for trial in self._trials:
                depth_mm = late(tip_depth_mm(trial), float(delay))[: FREE_TICKS + TOUCH_TICKS, 0]
                force = -trial.wrench[: FREE_TICKS + TOUCH_TICKS, 2]
                pressing = force > _PRESSING_N
                depths.append(depth_mm[pressing])
                forces.append(force[pressing])
            depth, force = np.concatenate(depths), np.concatenate(forces)
            if len(depth) < CONTROL_RATE_HZ // 14 or np.ptp(depth) == 0.0:
                raise UndeterminedError("stiffness", f"{len(depth)} samples under load", "trials that press")
            slope, level = np.polyfit(depth, force, 1)
            cost = float(np.sum((force - level - slope * depth) ** 2))
            if slope > 0.0 and cost < best:
                best = cost
                self.values[1] = slope / self._trials[0].config.cell.compliance.axial_N_per_mm
                # Higher is less deep.
                self.values[[PLATE, LATE]] = level / slope, delay

    def _best_delay(self) -> None:
        found, start = self.values, self.values.copy()
        best = _cost(self.residual(found, _ALONG))
        for ticks in _DELAYS:
            self.values = start.copy()
            self.values[LATE] = max(start[LATE] + ticks, 0.0)
            self._stage((1, 3, PLATE), _ALONG)
            if (cost := _cost(self.residual(self.values, _ALONG))) < best:
                best, found = cost, self.values
        self.values = found

    def _best_friction(self) -> None:
        best, start = _cost(self.residual(self.values, _ACROSS)), self.values.copy()
        for share in _FRICTIONS:
            values = start.copy()
            values[0] = start[0] * share
            if (cost := _cost(self.residual(values, _ACROSS))) < best:
                best, self.values = cost, values
        self._gone_through()

    def _jacobian(self, rest: Array, knobs: npt.NDArray[np.int64], axes: Sequence[int]) -> Array:
        columns = []
        for number in knobs:
            knob, beside = KNOBS[number], self.values.copy()
            beside[number] += knob.step if beside[number] + knob.step <= knob.high else -knob.step
            columns.append((self.residual(beside, axes) - rest) / (beside[number] - self.values[number]))
        return np.column_stack(columns)

    def _noise(self) -> Array:
        """Standard deviation of each channel in free air, (6,), a slow change taken out."""
        parts = []
        for trial in self._trials:
            free = trial.wrench[: FREE_TICKS - BEFORE_TICKS]
            free = free[~np.isnan(free[:, 0])]
            parts.append(np.diff(free, axis=0).ravel().reshape(-1, 6) / sqrt(2.0))
        rows = np.concatenate(parts)
        if len(rows) < CONTROL_RATE_HZ // 5:
            raise UndeterminedError("noise", f"{len(rows)} samples in free air", "trials that begin above the plate")
        return np.maximum(np.sqrt(np.mean(rows**2, axis=0)), (1e-3,) * 3 + (1e-5,) * 3)


def _cost(rest: Array) -> float:
    return float(np.sum(np.log1p((rest / _ROBUST) ** 2)))
