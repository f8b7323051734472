"""Training data for the contact model: the contacts in a trial that ended in the hole, and the hole's position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeGuard

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import EpisodeOutcome, Observation
from palpate.core.policy.belief.arithmetic import Floats

LENGTH_M: Final = 1e-7
"""Unit for stored positions, which are integer multiples of it in every log; an encoder step is far larger."""
TORQUE_NM: Final = 1e-6
"""Unit for stored torques, a thousandth of the noise of a precise sensor."""
FORCE_N: Final = 1e-3
"""Unit for stored forces."""
NOMINAL_N: Final = 4.9
"""Pressing force for which a contact model is defined."""
_LEAST_N: Final = 1.0
_FARTHEST: Final = round(0.1 / LENGTH_M)
"""Bounds that detect wrong units: 100 mm from the goal, 100 N m, 1 kN."""
_GREATEST: Final = (_FARTHEST, _FARTHEST, round(100.0 / TORQUE_NM), round(100.0 / TORQUE_NM), round(1e3 / FORCE_N))
_MAX_CONTACTS: Final = 120
"""Maximum number of contacts stored per trial; the latest are kept. A blind search has many similar contacts."""


def place_of(place_m: tuple[float, float]) -> tuple[int, int]:
    """Return a position, (x, y), in units of ``LENGTH_M``."""
    x, y = place_m
    return round(x / LENGTH_M), round(y / LENGTH_M)


@dataclass(frozen=True, slots=True)
class ContactObservation:
    """A wrench measured while the peg presses on the plate.

    Attributes:
        place: Commanded tip position, (2,), task frame, in units of ``LENGTH_M``.
        torque: Torque about the tip, (2,), in units of ``TORQUE_NM``.
        press: Force with which the peg presses on the plate, in units of ``FORCE_N``.
    """

    place: tuple[int, int]
    torque: tuple[int, int]
    press: int

    @classmethod
    def of(cls, observation: Observation) -> ContactObservation:
        """Extract the contact from an observation."""
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
        """Return the commanded tip position, (2,)."""
        return self.place[0] * LENGTH_M, self.place[1] * LENGTH_M

    @property
    def torque_Nm(self) -> tuple[float, float]:
        """Return the torque about the tip, (2,)."""
        return self.torque[0] * TORQUE_NM, self.torque[1] * TORQUE_NM

    @property
    def load(self) -> float:
        """Return the pressing force divided by ``NOMINAL_N``; it multiplies the contact point's lever."""
        return self.press * FORCE_N / NOMINAL_N


@dataclass(frozen=True, slots=True)
class ContactTrial:
    """A trial that ended in the hole.

    Attributes:
        hole: Hole position, (2,), task frame, in units of ``LENGTH_M``.
    """

    hole: tuple[int, int]
    contacts: tuple[ContactObservation, ...]

    @property
    def hole_m(self) -> tuple[float, float]:
        """Return the hole position, (2,), task frame."""
        return self.hole[0] * LENGTH_M, self.hole[1] * LENGTH_M

    @classmethod
    def of(cls, episode: EpisodeOutcome, contacts: Sequence[ContactObservation]) -> ContactTrial:
        """Create the record from the last contacts and the outcome of a trial that ended in the hole."""
        x, y, _ = episode.tip_m
        return cls((round(x / LENGTH_M), round(y / LENGTH_M)), tuple(contacts[-_MAX_CONTACTS:]))

    def to_dict(self) -> dict[str, Any]:
        """Return plain JSON integers; a contact is position and torque, in x and y, and pressing force."""
        contacts = [[*contact.place, *contact.torque, contact.press] for contact in self.contacts]
        return {"hole": list(self.hole), "contacts": contacts}

    @classmethod
    def from_dict(cls, where: str, data: Any) -> ContactTrial:
        """Read the result of :meth:`to_dict`.

        Raises:
            ConfigurationError: The data are invalid.
        """
        accepted = (
            "the hole as two whole numbers, each contact as five: x and y in 0.1 um up to 100 mm, torques in uN m up to"
            " 100 N m, the pressing force in mN up to 1 kN"
        )
        if not isinstance(data, Mapping) or set(data) != {"hole", "contacts"}:
            raise ConfigurationError(where, data, accepted)
        hole, contacts = data["hole"], data["contacts"]
        if (
            not isinstance(contacts, Sequence)
            or not _within(hole, _GREATEST[:2])
            or not all(_within(row, _GREATEST) and row[4] > 0 for row in contacts)
        ):
            raise ConfigurationError(where, data, accepted)
        return cls((hole[0], hole[1]), tuple(ContactObservation((a, b), (c, d), e) for a, b, c, d, e in contacts))


def _within(row: object, greatest: Sequence[int]) -> TypeGuard[list[int]]:
    """Return True for a list of integers whose magnitudes do not exceed the given bounds."""
    return (
        isinstance(row, list)
        and len(row) == len(greatest)
        and all(type(value) is int and abs(value) <= most for value, most in zip(row, greatest, strict=True))
    )


@dataclass(frozen=True, slots=True)
class Examples:
    """The contacts from several trials as arrays, each with the displacement from the tip to the hole.

    Attributes:
        torque_Nm: Torque about the tip, (n, 2).
        load: Pressing force divided by ``NOMINAL_N``, (n,).
        to_hole_m: Displacement from the commanded tip to the hole, (n, 2).
        step_m: Displacement from the previous contact to this one, (n, 2); 0 for the first in a trial.
        trial: Trial number, (n,).
    """

    torque_Nm: Floats
    load: Floats
    to_hole_m: Floats
    step_m: Floats
    trial: np.ndarray

    @classmethod
    def of(cls, trials: Sequence[ContactTrial]) -> Examples:
        """Collect all contacts from the given trials."""
        rows, numbers = [], []
        for number, trial in enumerate(trial for trial in trials if trial.contacts):
            before = None
            for contact in trial.contacts:
                x, y = contact.place
                px, py = (x, y) if before is None else before.place
                rows.append((*contact.torque, trial.hole[0] - x, trial.hole[1] - y, x - px, y - py, contact.load))
                numbers.append(number)
                before = contact
        table = np.array(rows, dtype=np.float64).reshape(len(rows), 7)
        torque_Nm, to_hole_m, step_m = table[:, :2] * TORQUE_NM, table[:, 2:4] * LENGTH_M, table[:, 4:6] * LENGTH_M
        return cls(torque_Nm, table[:, 6].copy(), to_hole_m, step_m, np.array(numbers, dtype=int))
