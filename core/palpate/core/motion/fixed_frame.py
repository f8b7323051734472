"""A frame that does not move, in plain floats: for a single vector these are faster than a call of Pinocchio."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import pinocchio as pin

from palpate.core.ports import Vector3


def rotated(rotation: Sequence[Sequence[float]], vector: Vector3) -> Vector3:
    """A vector (3,) by a rotation, (3, 3), row by row."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


class FixedFrame:
    """Takes places and vectors, (3,), from the base frame into this one, and back.

    Attributes:
        vector: Takes a vector of the base frame, (3,), and gives it in this one.
    """

    def __init__(self, in_base: pin.SE3) -> None:
        self._origin_m: list[float] = in_base.translation.tolist()
        self._to_base: list[list[float]] = in_base.rotation.tolist()
        self.vector: Callable[[Vector3], Vector3] = partial(rotated, in_base.rotation.T.tolist())

    def place_m(self, in_base_m: Sequence[float]) -> Vector3:
        """A place of the base frame in this one."""
        (x, y, z), (u, v, w) = in_base_m, self._origin_m
        return self.vector((x - u, y - v, z - w))

    def place_in_base_m(self, place_m: Vector3) -> Vector3:
        """A place of this frame in the base frame."""
        (x, y, z), (u, v, w) = rotated(self._to_base, place_m), self._origin_m
        return x + u, y + v, z + w
