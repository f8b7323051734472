"""How stiff the gripper is across, and where the hole is: of the force by which its wall holds a peg."""

from dataclasses import dataclass
from math import hypot, pi, sqrt
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from palpate.adapters.config import RunConfig
from palpate.adapters.log import TickRecord, TrialLog
from palpate.core.motion import Kinematics, ToolGeometry, arm_named
from palpate.core.ports import Validity
from palpate.core.trial import Outcome, Phase, goal_in_base
from palpate.simulation.work_cell import CellConfig

Array: TypeAlias = npt.NDArray[np.float64]

_MOST_TICKS: Final = 120
_SMOOTH_TICKS: Final = 5
_LEAST_N: Final = 4.0
"""A wall that holds with less says little."""
_LEAST_TICKS: Final = 10
_FREE_SHARE: Final = 0.1
_AFTER_TICKS: Final = 15
"""Where the wall has let go says where it is."""
_NOISE_N: Final = 0.1
_ROBUST: Final = 4.0
_SLIP_N: Final = 0.2
_ABOVE_N: Final = 0.5
"""A peg that sticks and slips down its wall lets go of it for some ticks, which a spring never pushes harder for: what
is missing counts less from the one on, what is too much from the other."""
_WALL_SPREAD: Final = 0.05
"""Deviation of what a wall says, by more walls than one log holds: three that agree by chance would tell too little."""
_WALLS_SHARE: Final = 0.035
"""A wall is no spring alone: rubbing on it shifts what is found by so much, whatever the number of walls."""


@dataclass(frozen=True)
class Walled:
    """A peg in its hole, tick by tick, from where it begins to sink.

    Attributes:
        led_mm: The believed tip by the encoders, (ticks, 2), task frame.
        force_N: Of the world on the tool, tared, across, (ticks, 2), task frame; NaN where nothing was valid.
        play_mm: How far the peg may be from the hole's axis.
    """

    led_mm: Array
    force_N: Array
    play_mm: float


def walled_from(log: TrialLog, config: RunConfig, slots: dict[int, TickRecord], bias: Array) -> Walled | None:
    """The last insertion of a trial that ended inserted; None where it did not.

    Args:
        slots: The ticks by their control periods since the first one.
        bias: Tare, (6,).
    """
    sinks = [each.tick for each in log.events if each.name == "phase" and each.detail == Phase.INSERT.value]
    if log.end is None or log.end.outcome != Outcome.INSERTED.value or not sinks:
        return None
    numbers = [slot for slot, each in slots.items() if each.tick >= sinks[-1]][:_MOST_TICKS]
    kinematics, task = Kinematics(arm_named(config.arm), ToolGeometry()), goal_in_base(config.task.goal)
    turn = task.rotation.T @ np.array(log.start.tip_rotation).reshape(3, 3)
    count = numbers[-1] - numbers[0] + 1
    led_mm, force_N = np.full((count, 2), np.nan), np.full((count, 2), np.nan)
    for slot in numbers:
        record, row = slots[slot], slot - numbers[0]
        if record.joints is not None and record.joints.validity is Validity.VALID:
            kinematics.update(record.joints.position_rad)
            led_mm[row] = task.actInv(kinematics.tip_position_m)[:2] * 1e3
        if record.wrench is not None and record.wrench.validity is Validity.VALID:
            force_N[row] = (turn @ (np.array(record.wrench.force_N) - bias[:3]))[:2]
    ticks = np.arange(count)
    known = ~np.isnan(led_mm[:, 0])
    led_mm = np.column_stack([np.interp(ticks, ticks[known], column[known]) for column in led_mm.T])
    return Walled(led_mm, force_N, config.cell.worn_clearance_mm)


def held_by(walled: Walled, late_ticks: float) -> tuple[float, Array] | None:
    """Fit a spring that pushes the peg back as far as it is led into the wall, from the greatest force on.

    Args:
        late_ticks: By how much forces come after the angles that were read with them.

    Returns:
        Stiffness in N/mm, and where the hole's axis is, (2,), m, task frame; None where no wall held it well.
    """
    size = np.nan_to_num(np.hypot(*walled.force_N.T))
    smooth = np.convolve(size, np.ones(_SMOOTH_TICKS) / _SMOOTH_TICKS, "same")
    top = int(np.argmax(smooth))
    free = np.flatnonzero(smooth[top:] < _FREE_SHARE * smooth[top])
    end = min(top + int(free[0]) + _AFTER_TICKS, len(size)) if len(free) else len(size)
    at = np.arange(top, end) - late_ticks
    ticks = np.arange(len(size))
    led = np.column_stack([np.interp(at, ticks, column) for column in walled.led_mm.T])
    known = ~np.isnan(walled.force_N[top:end, 0])
    led, force = led[known], walled.force_N[top:end][known]
    if smooth[top] < _LEAST_N or len(led) < _LEAST_TICKS:
        return None

    def rest(found: Array) -> Array:
        aside = led - found[1:]
        away = np.hypot(*aside.T) + 1e-9
        push = -found[0] * np.maximum(away - walled.play_mm, 0.0) / away
        rests: Array = ((push[:, None] * aside - force) / _NOISE_N).ravel()
        return rests

    def rest_of_slips(found: Array) -> Array:
        aside = led - found[1:]
        away = np.hypot(*aside.T) + 1e-9
        x, y = (aside / away[:, None]).T
        above = -force[:, 0] * x - force[:, 1] * y - found[0] * np.maximum(away - walled.play_mm, 0.0)
        scale = np.where(above < 0.0, _SLIP_N, _ABOVE_N)
        along = np.sign(above) * scale * np.sqrt(np.log1p((above / scale) ** 2))
        rests: Array = np.concatenate([along, force[:, 0] * y - force[:, 1] * x]) / _NOISE_N
        return rests

    units = (5.0, 0.05, 0.05)
    begin = least_squares(rest, (25.0, *led[-1]), loss="soft_l1", f_scale=_ROBUST, x_scale=units)
    fit = least_squares(rest_of_slips, begin.x, x_scale=units)
    return float(fit.x[0]), fit.x[1:] * 1e-3


def told_by(shares: Array) -> tuple[float, float] | None:
    """What walls tell together, of what each says: the median, and its deviation; None of no walls.

    Args:
        shares: (walls,).
    """
    if not len(shares):
        return None
    share = float(np.median(shares))
    spread = max(1.4826 * float(np.median(np.abs(shares - share))), _WALL_SPREAD * share)
    return share, hypot(sqrt(pi / 2.0) * spread / sqrt(len(shares)), _WALLS_SHARE * share)


def across_N_per_mm(cell: CellConfig) -> float:
    """Stiffness across at the tip, of a gripper that tilts about its centre of compliance too."""
    springs = cell.compliance
    lever_m = springs.centre_above_tip_mm * 1e-3
    return 1.0 / (1.0 / springs.lateral_N_per_mm + 1e3 * lever_m**2 / springs.tilt_Nm_per_rad)
