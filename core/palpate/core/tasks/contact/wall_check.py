"""Is the peg between walls? A light push across the tool axis is answered there, and nowhere else."""

from __future__ import annotations

from collections import deque
from math import hypot
from typing import Final

from palpate.core.ports import Vector3

ANSWER_N: Final = 1.2
"""Change of the lateral force, against the push, that counts as an answer."""
SPEED_M_S: Final = 0.002
"""So slow that a wall of 40 N/mm is felt before the push exceeds 3 N, servos and averages included."""
_SAMPLES: Final = 4
BEND_M: Final = 1e-4
"""What the gripper may bend under the push."""


class WallCheck:
    """Pushes sideways until a wall answers, or until the peg has gone further than the hole's play.

    The push goes against whatever lateral force there is, so that a peg that leans on one wall is led to the other.

    Attributes:
        from_m: Place that way counts from, (3,), task frame.
        way: Direction of the push, (2,).
        failed: Whether the peg went further than the play without an answer.
    """

    def __init__(self, play_m: float) -> None:
        self._reach_m = play_m + BEND_M

    def begin(self, from_m: Vector3) -> None:
        """The next :meth:`velocity_m_s` is the first of a check; way counts from this place, (3,), task frame."""
        self.answered, self.failed, self.answer_N = False, False, 0.0
        self._forces: deque[tuple[float, float]] = deque(maxlen=_SAMPLES)
        self._base_N: tuple[float, float] | None = None
        self.from_m = from_m

    def bounded(self, velocity_m_s: Vector3, reference_m: Vector3) -> Vector3:
        """A velocity of the tip, without its part across the tool axis once the tip is as far out as a wall can be."""
        vx, vy, vz = velocity_m_s
        return (0.0, 0.0, vz) if self.past(vx, vy, reference_m) else velocity_m_s

    def past(self, vx: float, vy: float, reference_m: Vector3) -> bool:
        """Whether the tip is as far out as a wall can be, and such a velocity across leads it further."""
        x, y = reference_m[0] - self.from_m[0], reference_m[1] - self.from_m[1]
        return hypot(x, y) > self._reach_m and x * vx + y * vy > 0.0

    def velocity_m_s(self, force_N: Vector3, new: bool, reference_m: Vector3) -> tuple[float, float]:
        """Velocity of the tip across the tool axis for this tick; zero once a wall has answered.

        Args:
            force_N: Tared force of the environment on the tool, (3,), task frame.
            reference_m: Where the tip is commanded to be, (3,), task frame.
        """
        if new:
            self._forces.append((force_N[0], force_N[1]))
        if len(self._forces) < _SAMPLES or self.answered:
            return 0.0, 0.0
        fx = sum(x for x, _ in self._forces) / _SAMPLES
        fy = sum(y for _, y in self._forces) / _SAMPLES
        if self._base_N is None:
            self._base_N = (fx, fy)
            size = hypot(fx, fy)
            self.way = (fx / size, fy / size) if size > 0.0 else (1.0, 0.0)
        (ux, uy), (bx, by) = self.way, self._base_N
        self.answer_N = max(self.answer_N, (bx - fx) * ux + (by - fy) * uy)
        self.answered = self.answer_N >= ANSWER_N
        vx, vy = SPEED_M_S * ux, SPEED_M_S * uy
        self.failed = not self.answered and self.past(vx, vy, reference_m)
        return (0.0, 0.0) if self.answered or self.failed else (vx, vy)
