"""The fit of a simulated cell to what was felt in recorded trials."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import hypot, inf, nan, pi, sqrt
from typing import Final

import numpy as np
import numpy.typing as npt

from palpate.adapters.replay.gap_cell import (
    FREE_TICKS,
    KNOBS,
    LATE,
    PLATE,
    SETTLED,
    SHARED,
    Array,
    Driven,
    drive,
    free_noise,
    late,
    led_tip_mm,
)
from palpate.adapters.replay.gap_numbers import cost, deviations, lowest, mean_over, middle_of, normal_equations
from palpate.adapters.replay.gap_wall import across_N_per_mm, held_by, told_by
from palpate.core.errors import UndeterminedError
from palpate.core.ports import CONTROL_RATE_HZ

TOUCH_TICKS: Final = 20
"""A touch is over after so many."""
_PRESSING_N: Final = 0.5
_ALONG: Final = 2
_SMOOTH_TICKS: Final = 7
_TWO_CYCLES: Final = 4
"""Control ticks of two cycles of a bus at half the control rate."""
_FRICTION_STEP: Final = 1.4
_FRICTION_SPREAD: Final = 0.2
_FRICTIONS: Final = 7
_DELAYS: Final = np.arange(0.0, 20.0, 0.25)
"""In control ticks."""
_TOUCH_SHARE: Final = 0.025
_DELAY_TICKS: Final = 0.15
"""What buses that interpolate between set-points do to a touch and to its time is the same in each trial: over emulated
wires it came to so much."""
_ROUNDS: Final = 12
_PASSES: Final = 2
_DONE: Final = 1e-3
_MEDIAN_SD: Final = 1.4826 * sqrt(pi / 2.0)
"""Standard deviation of a median of n is this, times the median deviation, over sqrt(n)."""


class CellFit:
    """Gauss-Newton with damping over all trials; far residuals count less, because a stick is no slip.

    Friction is not asked of traces: a peg that slides sticks and slips, when is chaotic, and of two traces that are out
    of step the smaller one has the smaller residual, which reads friction low.

    Attributes:
        with_age_ticks: The delay, and the age of the encoders' angles besides.
        walls: What each wall that held a peg says of the stiffness across, a share of the configured one.
    """

    def __init__(self, trials: Sequence[Driven], gone_through: Callable[[], object]) -> None:
        self._trials, self._gone_through = trials, gone_through
        self._traces: dict[tuple[float | tuple[int, ...] | None, ...], list[tuple[Array, Array]]] = {}
        self._touches = (FREE_TICKS + TOUCH_TICKS,) * len(trials)
        self.noise = free_noise(trials)
        self.with_age_ticks, self.walls = 0.0, np.empty(0)
        self.values = np.array([trials[0].config.cell.peg.friction, 1.0, 1.0,
                                trials[0].config.cell.compliance.damping_ratio, 0.0, 0.0])  # fmt: skip

    def traces(self, values: Array, ticks: tuple[int, ...] | None = None) -> list[tuple[Array, Array]]:
        """Of each trial, to its end or so many ticks; simulated once for each setting of the cell."""
        key = (ticks, *values[:LATE].tolist())
        if key not in self._traces:
            if len(self._traces) > len(KNOBS):
                self._traces.clear()
            until = ticks or (None,) * len(self._trials)
            self._traces[key] = [drive(trial, values, end) for trial, end in zip(self._trials, until, strict=True)]
        return self._traces[key]

    def residuals(self, values: Array) -> list[Array]:
        """Recorded minus simulated force along the tool of each trial as it touches, over the noise, (m,)."""
        # What the force along the tool says of the touch is clean before the peg wanders over the hole's edge.
        ticks, rows = self._touches, []
        for trial, end, (wrench, _) in zip(self._trials, ticks, self.traces(values, ticks), strict=True):
            rest = (trial.wrench[:end] - late(wrench, float(values[LATE])))[SETTLED.start :, _ALONG]
            rows.append(rest[~np.isnan(rest)] / self.noise[_ALONG])
        return rows

    def run(self) -> Array:
        """Find the best values; returns their standard deviations.

        Stiffness, damping, plate and delay are asked of the force along the tool as it touches, stiffness across of
        the wall that holds a peg which goes in aside, friction of the force across as it slides. Where no wall held
        it, stiffness across is taken to be as much softer as that along, and told as not determined: until a peg slips
        is over within two bus cycles.
        """
        self._begin()
        sds = self._stage((1, PLATE, LATE))
        self.values[2] = self.values[1]
        self._stage((1, 3, PLATE, LATE))
        self.fit_delay()
        for _ in range(_PASSES):
            self._ask_walls()
            self.values[2], sds[2] = told_by(self.walls) or (self.values[1], inf)
            self.fit_delay()
            sds[[1, 3, PLATE]] = self._stage((1, 3, PLATE))[[1, 3, PLATE]]
            sds[0] = self.fit_friction()
        sds[1], sds[LATE] = hypot(sds[1], _TOUCH_SHARE * self.values[1]), hypot(self.fit_delay(), _DELAY_TICKS)
        return sds

    def run_as(self, other: Array) -> Array:
        """Find plate and delay of a cell whose friction, stiffnesses and damping these values tell, (knobs,).

        A set that is misread is so as a whole: what a wrong spring does to a touch goes into the delay. Damping does
        likewise, by 1.4 ticks for 1.0: asked of each of two sets it made 17.1 of a difference of 20 ms. What a
        sensor's filter damps is in it, and what another one damps more is a delay of its own.

        Returns:
            Standard deviations; those of friction, stiffnesses and damping are infinite.
        """
        self._begin()
        self.values[SHARED] = other[SHARED]
        sds = self._stage((PLATE, LATE))
        self.fit_delay()
        for _ in range(_PASSES):
            self._ask_walls()
            self.fit_delay()
            sds[PLATE] = self._stage((PLATE,))[PLATE]
        sds[LATE] = hypot(self.fit_delay(), _DELAY_TICKS)
        return sds

    def joints_late(self) -> float:
        """By how many ticks the encoders are behind the simulated ones, by least squares."""
        traces = self.traces(self.values)
        costs = [
            sum(
                float(np.nansum((t.joints_rad - late(q, float(ticks))) ** 2))
                for t, (_, q) in zip(self._trials, traces, strict=True)
            )
            for ticks in _DELAYS
        ]
        return lowest(_DELAYS, costs)

    def _ask_walls(self) -> None:
        """Ask walls that held pegs how stiff it is across, and put holes where they say."""
        behind = float(self.values[LATE]) - self.joints_late()
        held = [None if trial.walled is None else held_by(trial.walled, behind) for trial in self._trials]
        self._trials = [
            trial if wall is None else replace(trial, hole_m=(float(wall[1][0]), float(wall[1][1])))
            for trial, wall in zip(self._trials, held, strict=True)
        ]
        self._traces.clear()
        shares = np.array([wall[0] for wall in held if wall is not None])
        self.walls = np.clip(shares / across_N_per_mm(self._trials[0].config.cell), KNOBS[2].low, KNOBS[2].high)

    def _stage(self, fitted: Sequence[int]) -> Array:
        knobs = np.array(fitted)
        damping, rests = 1e-2, self.residuals(self.values)
        sds = np.full(len(KNOBS), inf)
        for _ in range(_ROUNDS):
            jacobians = self._jacobians(rests, knobs)
            normal, slopes = normal_equations(jacobians, rests)
            slope = slopes.sum(axis=0)
            sds[knobs] = deviations(normal, slopes, rests)
            moved = False
            for _ in range(5):
                tried = self.values.copy()
                tried[knobs] -= np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-12), slope)
                tried = np.array([np.clip(v, k.low, k.high) for v, k in zip(tried, KNOBS, strict=True)])
                rests_there = self.residuals(tried)
                if cost(rests_there) < cost(rests):
                    moved = cost(rests) - cost(rests_there) > _DONE * cost(rests)
                    self.values, rests, damping = tried, rests_there, damping * 0.3
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
                depth_mm = late(led_tip_mm(trial), float(delay))[: FREE_TICKS + TOUCH_TICKS, 2]
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

    def fit_delay(self) -> float:
        """Find the delay with which all forces of a trial follow the simulated ones; returns its deviation.

        A touch alone leaves it open, for one that comes later looks much like a plate that is lower, and what is felt
        across alone hangs on when a peg slips. Modules that hold a set-point for a bus cycle make stairs of a motion,
        which fit at either edge; means over two cycles have none.
        """
        delays, noise = [], self.noise[:3] / sqrt(_TWO_CYCLES)
        for trial, (wrench, _) in zip(self._trials, self.traces(self.values), strict=True):
            felt, costs = mean_over(trial.wrench[:, :3], _TWO_CYCLES)[SETTLED.start :], []
            known = ~np.isnan(felt[:, 0])
            for ticks in _DELAYS:
                simulated = mean_over(late(wrench[:, :3], float(ticks)), _TWO_CYCLES)[SETTLED.start :]
                costs.append(cost([((felt - simulated) / noise)[known]]))
            delays.append(lowest(_DELAYS, costs))
        ages = np.array([trial.joints_age_ticks for trial in self._trials])
        self.values[LATE], self.with_age_ticks = middle_of(np.array(delays)), middle_of(delays + ages)
        if len(delays) < 2:
            return inf
        return _MEDIAN_SD * float(np.median(np.abs(delays - self.values[LATE]))) / sqrt(len(delays))

    def fit_friction(self) -> float:
        """Find the friction with which pegs slide as hard as was felt, in the median; returns its deviation."""
        felt = np.array([sliding_share(trial.wrench) for trial in self._trials])
        if np.isnan(felt).all():
            return inf
        here = max(float(self.values[0]), KNOBS[0].step)
        missing = float(np.nanmedian(felt - self._slide(here)))
        step = _FRICTION_STEP if missing > 0.0 else 1.0 / _FRICTION_STEP
        there = here
        while there * step < KNOBS[0].high and there * step > KNOBS[0].step:
            here, there = there, there * step
            if float(np.nanmedian(felt - self._slide(there))) * missing <= 0.0:
                break
        middle = sqrt(here * there)
        # One friction's traces are chance; a line through several's is not.
        frictions = middle * np.linspace(1.0 - _FRICTION_SPREAD, 1.0 + _FRICTION_SPREAD, _FRICTIONS)
        gaps = np.array([felt - self._slide(float(friction)) for friction in frictions])
        gaps = gaps[:, ~np.isnan(felt)]
        slope, level = np.polyfit(frictions, np.median(gaps, axis=1), 1)
        if slope >= 0.0:
            return inf
        self.values[0] = np.clip(-level / slope, KNOBS[0].low, KNOBS[0].high)
        off = np.abs(gaps - (level + slope * frictions)[:, None])
        return float(_MEDIAN_SD * np.median(off) / sqrt(gaps.shape[1]) / -slope)

    def _slide(self, friction: float) -> Array:
        """Share across of each trial's simulated forces, (trials,)."""
        values = self.values.copy()
        values[0] = friction
        self._gone_through()
        return np.array([
            sliding_share(np.where(np.isnan(trial.wrench), np.nan, late(wrench, float(values[LATE]))))
            for trial, (wrench, _) in zip(self._trials, self.traces(values), strict=True)
        ])  # fmt: skip

    def _jacobians(self, rests: Sequence[Array], knobs: npt.NDArray[np.int64]) -> list[Array]:
        columns = []
        for number in knobs:
            knob, beside = KNOBS[number], self.values.copy()
            beside[number] += knob.step if beside[number] + knob.step <= knob.high else -knob.step
            step = beside[number] - self.values[number]
            columns.append([(there - rest) / step for there, rest in zip(self.residuals(beside), rests, strict=True)])
        return [np.column_stack(each) for each in zip(*columns, strict=True)]


def sliding_share(wrench: Array) -> float:
    """Force across over force along the tool after the touch, of means over some ticks; NaN where there are too few.

    Args:
        wrench: (ticks, 6), frame of the tool.
    """
    rows = wrench[FREE_TICKS + TOUCH_TICKS :, :3]
    rows = rows[~np.isnan(rows[:, 0])]
    if len(rows) <= _SMOOTH_TICKS:
        return nan
    smooth = mean_over(rows, _SMOOTH_TICKS)
    along = float(np.abs(smooth[:, 2]).sum())
    return float(np.hypot(smooth[:, 0], smooth[:, 1]).sum()) / along if along > 0.0 else nan
