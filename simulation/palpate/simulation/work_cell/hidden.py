"""Hidden values of an emulated rig, drawn from a seed, which commissioning must find."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from math import cos, radians, sin
from typing import Any, Final

from palpate.core.ports import Vector3
from palpate.core.trial import Purpose, generator
from palpate.simulation.work_cell.config import CellConfig

_GRAVITY_M_S2: Final = 9.81
_GRIPPER_KG: Final = (0.1, 0.5)
_ACROSS_M: Final = 0.012
_ALONG_M: Final = (0.02, 0.07)
_MOUNTING_DEG: Final = 12.0
_PLATE_MM: Final = 1.5
_HOLE_MM: Final = 2.0
_STIFFNESS: Final = (0.6, 1.6)


@dataclass(frozen=True)
class HiddenValues:
    """A rig's true values, which differ from its configuration.

    Attributes:
        gripper_kg: Mass between the force sensor and the springs, in addition to the configured mass.
        centre_of_mass_m: Centre of this mass, (3,), in the tool frame.
        mounting_deg: Rotation of the sensor about the tool's axis, from x towards y.
        plate_mm: The plate's height above nominal.
        hole_mm: Maximum distance of the hole from the nominal goal.
        axial_share: The gripper's axial stiffness, relative to the configured value.
        springs_share: Stiffness of all gripper springs, relative to the configured value.
        friction: Friction between the peg and the plate, or None for the configured value.
        latency_ms: Latency of wrench measurements.
    """

    gripper_kg: float = 0.0
    centre_of_mass_m: Vector3 = (0.0, 0.0, 0.0)
    mounting_deg: float = 0.0
    plate_mm: float = 0.0
    hole_mm: float = 0.0
    axial_share: float = 1.0
    springs_share: float = 1.0
    friction: float | None = None
    latency_ms: float = 0.0

    @classmethod
    def drawn(cls, seed: int) -> HiddenValues:
        """Draw the values from a seed."""
        rng = generator(seed, Purpose.HIDDEN, 0)
        return cls(
            gripper_kg=rng.uniform(*_GRIPPER_KG),
            centre_of_mass_m=(
                rng.uniform(-_ACROSS_M, _ACROSS_M),
                rng.uniform(-_ACROSS_M, _ACROSS_M),
                rng.uniform(*_ALONG_M),
            ),
            mounting_deg=rng.uniform(-_MOUNTING_DEG, _MOUNTING_DEG),
            plate_mm=rng.uniform(-_PLATE_MM, _PLATE_MM),
            hole_mm=_HOLE_MM,
            axial_share=rng.uniform(*_STIFFNESS),
        )

    def cell(self, config: CellConfig) -> CellConfig:
        """Return the configured cell with the values that affect its physics."""
        names = ("lateral_N_per_mm", "axial_N_per_mm", "tilt_Nm_per_rad", "torsion_Nm_per_rad")
        springs = {name: getattr(config.compliance, name) * self.springs_share for name in names}
        springs["axial_N_per_mm"] *= self.axial_share
        return replace(
            config,
            peg=config.peg if self.friction is None else replace(config.peg, friction=self.friction),
            compliance=replace(config.compliance, **springs),
            conditions=replace(config.conditions, hole_shift_mm=max(self.hole_mm, config.conditions.hole_shift_mm)),
            hole_height_error_mm=config.hole_height_error_mm + self.plate_mm,
        )

    def measured(self, wrench: list[float], down_in_tool: Any) -> list[float]:
        """Return a wrench, (6,), as measured by the rotated sensor, including the gripper's weight.

        Args:
            wrench: Wrench in the configured cell, (6,), in the tool frame.
            down_in_tool: Unit vector pointing down, (3,), in the tool frame. Accelerations are well below gravity.
        """
        weight_N = self.gripper_kg * _GRAVITY_M_S2
        gx, gy, gz = (weight_N * float(each) for each in down_in_tool)
        px, py, pz = self.centre_of_mass_m
        fx, fy, fz, tx, ty, tz = wrench
        fx, fy, fz = fx + gx, fy + gy, fz + gz
        tx, ty, tz = tx + py * gz - pz * gy, ty + pz * gx - px * gz, tz + px * gy - py * gx
        c, s = cos(radians(self.mounting_deg)), sin(radians(self.mounting_deg))
        return [c * fx + s * fy, c * fy - s * fx, fz, c * tx + s * ty, c * ty - s * tx, tz]


class SampleDelay:
    """Delay line for wrenches, with interpolation between ticks for fractional delays."""

    def __init__(self, ticks: float) -> None:
        self._whole, self._rest = int(ticks), ticks - int(ticks)
        self._past: deque[list[float]] = deque(maxlen=self._whole + 2)

    def begin(self) -> None:
        """Clear the history."""
        self._past.clear()

    def passed(self, wrench: list[float]) -> list[float]:
        """Add this tick's wrench, (6,); return the delayed one, or the oldest available at the start."""
        self._past.append(wrench)
        newer, older = (self._past[max(len(self._past) - 1 - ago, 0)] for ago in (self._whole, self._whole + 1))
        return [a + self._rest * (b - a) for a, b in zip(newer, older, strict=True)]
