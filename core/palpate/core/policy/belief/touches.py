"""What a trial's touches were, and, when it ended in the hole, where that is: the examples of the touch model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeGuard

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Hindsight, Observation
from palpate.core.policy.belief.arithmetic import Floats

LENGTH_M: Final = 1e-7
"""Places are kept as whole multiples of this: they are written into every log, and an encoder's step is far larger."""
TORQUE_NM: Final = 1e-6
"""Torques are kept as whole multiples of this, a thousandth of a good sensor's noise."""
FORCE_N: Final = 1e-3
"""Forces likewise."""
NOMINAL_N: Final = 4.9
"""The pressing force that a touch model is given for."""
_LEAST_N: Final = 1.0
_FARTHEST: Final = round(0.1 / LENGTH_M)
"""No place is further than 100 mm from the goal, no torque above 100 N m, no force above 1 kN: else units differ."""
_GREATEST: Final = (_FARTHEST, _FARTHEST, round(100.0 / TORQUE_NM), round(100.0 / TORQUE_NM), round(1e3 / FORCE_N))
_MOST_TOUCHES: Final = 120
"""So many touches of a trial are remembered, its last ones; a blind search has many that are alike."""


def place_of(place_m: tuple[float, float]) -> tuple[int, int]:
    """A place, (x, y), in units of ``LENGTH_M``."""
    x, y = place_m
    return round(x / LENGTH_M), round(y / LENGTH_M)


@dataclass(frozen=True, slots=True)
class Touch:
    """One look at the wrench while the peg rests on the plate.

    Attributes:
        place: Commanded tip, (2,), task frame, in units of ``LENGTH_M``.
        torque: Torque about the tip, (2,), in units of ``TORQUE_NM``.
        press: Force with which the peg is pressed on the plate, in units of ``FORCE_N``.
    """

    place: tuple[int, int]
    torque: tuple[int, int]
    press: int

    @classmethod
    def of(cls, observation: Observation) -> Touch:
        """What an observation holds of it."""
        x, y, _ = observation.reference_m
        tx, ty, _ = observation.torque_Nm
        press_N = max(-observation.force_N[2], _LEAST_N)
        return cls(
            place_of((x, y)),
            (round(tx / TORQUE_NM), round(ty / TORQUE_NM)),
            round(press_N / FORCE_N),
        )

    @property
    def place_m(self) -> tuple[float, float]:
        """Commanded tip, (2,)."""
        return self.place[0] * LENGTH_M, self.place[1] * LENGTH_M

    @property
    def torque_Nm(self) -> tuple[float, float]:
        """Torque about the tip, (2,)."""
        return self.torque[0] * TORQUE_NM, self.torque[1] * TORQUE_NM

    @property
    def load(self) -> float:
        """Pressing force as a share of ``NOMINAL_N``: the lever of the place where the plate bears multiplies it."""
        return self.press * FORCE_N / NOMINAL_N


@dataclass(frozen=True, slots=True)
class TouchedTrial:
    """A trial that ended in the hole.

    Attributes:
        hole: Where the hole was, (2,), task frame, in units of ``LENGTH_M``.
    """

    hole: tuple[int, int]
    touches: tuple[Touch, ...]

    @property
    def hole_m(self) -> tuple[float, float]:
        """Where the hole was, (2,), task frame."""
        return self.hole[0] * LENGTH_M, self.hole[1] * LENGTH_M

    @classmethod
    def of(cls, hindsight: Hindsight, touches: Sequence[Touch]) -> TouchedTrial:
        """What a trial showed that ended in the hole, by its last touches."""
        x, y, _ = hindsight.tip_m
        return cls((round(x / LENGTH_M), round(y / LENGTH_M)), tuple(touches[-_MOST_TOUCHES:]))

    def to_dict(self) -> dict[str, Any]:
        """As plain JSON values: whole numbers; of each touch x and y of place and torque, and the pressing force."""
        touches = [[*touch.place, *touch.torque, touch.press] for touch in self.touches]
        return {"hole": list(self.hole), "touches": touches}

    @classmethod
    def from_dict(cls, where: str, data: Any) -> TouchedTrial:
        """Read what :meth:`to_dict` gave.

        Raises:
            ConfigurationError: It is something else.
        """
        accepted = (
            "the hole as two whole numbers, each touch as five: x and y in 0.1 um up to 100 mm, torques in uN m up to"
            " 100 N m, the pressing force in mN up to 1 kN"
        )
        if not isinstance(data, Mapping) or set(data) != {"hole", "touches"}:
            raise ConfigurationError(where, data, accepted)
        hole, touches = data["hole"], data["touches"]
        if not isinstance(touches, Sequence) or not _within(hole, _GREATEST[:2]) or not all(map(_is_touch, touches)):
            raise ConfigurationError(where, data, accepted)
        return cls((hole[0], hole[1]), tuple(Touch((a, b), (c, d), e) for a, b, c, d, e in touches))


def _is_touch(row: object) -> bool:
    return _within(row, _GREATEST) and row[4] > 0


def _within(row: object, greatest: Sequence[int]) -> TypeGuard[list[int]]:
    """Whether this is a list of whole numbers, none of them greater than these either way."""
    return (
        isinstance(row, list)
        and len(row) == len(greatest)
        and all(type(value) is int and abs(value) <= most for value, most in zip(row, greatest, strict=True))
    )


@dataclass(frozen=True, slots=True)
class Examples:
    """The touches of several trials as arrays, each with the way from where the peg was to the hole.

    Attributes:
        torque_Nm: Torque about the tip, (n, 2).
        load: Pressing force as a share of ``NOMINAL_N``, (n,).
        to_hole_m: From the commanded tip to the hole, (n, 2).
        step_m: From the touch before to this one, (n, 2); 0 for the first of a trial.
        trial: Number of the trial, (n,).
    """

    torque_Nm: Floats
    load: Floats
    to_hole_m: Floats
    step_m: Floats
    trial: np.ndarray

    @classmethod
    def of(cls, trials: Sequence[TouchedTrial]) -> Examples:
        """All touches of these trials."""
        rows, numbers = [], []
        for number, trial in enumerate(trial for trial in trials if trial.touches):
            before = None
            for touch in trial.touches:
                x, y = touch.place
                px, py = (x, y) if before is None else before.place
                rows.append((*touch.torque, trial.hole[0] - x, trial.hole[1] - y, x - px, y - py, touch.load))
                numbers.append(number)
                before = touch
        table = np.array(rows, dtype=np.float64).reshape(len(rows), 7)
        torque_Nm, to_hole_m, step_m = table[:, :2] * TORQUE_NM, table[:, 2:4] * LENGTH_M, table[:, 4:6] * LENGTH_M
        return cls(torque_Nm, table[:, 6].copy(), to_hole_m, step_m, np.array(numbers, dtype=int))
