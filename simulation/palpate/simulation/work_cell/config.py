"""The physical parameters of the simulated work cell, in the units an engineer would write them in."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import acos, ceil, pi
from typing import Annotated, ClassVar, Final

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.ports import OneOf, Range, Settings
from palpate.simulation.work_cell.conditions import ConditionsConfig
from palpate.simulation.work_cell.contour import FLAT, ContourConfig
from palpate.simulation.work_cell.cross_section import SIDES

SURFACE_BEGINS_MM: Final = 3.0
"""So far beside a round hole the broad boxes of the plate's surface begin."""
_LEAST_SPHERES: Final = 12


@dataclass(frozen=True)
class PegConfig(Settings):
    """Peg and hole."""

    TABLE: ClassVar[str] = "cell.peg"

    cross_section: Annotated[str, OneOf("round", "triangle", "square", "hexagon")] = "round"
    """Shape of peg and hole: round, triangle, square, hexagon."""
    contact: Annotated[str, OneOf("hull", "spheres")] = "hull"
    """hull: a peg with sides touches as the solid body that it is; spheres: with rings of them, as a round one does."""
    diameter_mm: Annotated[float, Range(1.0, 100.0)] = 29.0
    """Diameter of the peg; of its inscribed circle where it is a polygon."""
    clearance_mm: Annotated[float, Range(0.001, 5.0)] = 0.075
    """Gap between peg and hole all round when centred: half the difference of the diameters."""
    hole_depth_mm: Annotated[float, Range(0.5, 60.0)] = 10.0
    """Depth of the hole's floor below the plate's surface."""
    friction: Annotated[float, Range(0.0, 2.0)] = 0.2
    """Coulomb friction between peg and plate."""
    wall_boxes: Annotated[int, Range(16, 512)] = 48
    """Boxes that form the wall of a round hole (a polygon has one per side)."""
    outer_boxes: Annotated[int, Range(0, 512)] = 16
    """Boxes that form the plate's surface from 3 mm beside a round hole on; 0 is half of wall_boxes."""
    rim_spheres: Annotated[int, Range(12, 512)] = 48
    """Small spheres that form the contact ring at the peg's tip."""
    upper_spheres: Annotated[int, Range(0, 512)] = 24
    """Those of the second ring, 8 mm above it; 0 is as many as rim_spheres."""
    rim_radius_mm: Annotated[float, Range(0.01, 1.0)] = 0.1
    """Radius of those spheres: it is also a tiny chamfer, of a peg with sides as well."""

    @property
    def is_hull(self) -> bool:
        """Whether the peg touches as one convex body."""
        return self.contact == "hull" and self.cross_section in SIDES

    @override
    def check(self) -> None:
        if 0 < self.upper_spheres < _LEAST_SPHERES:
            raise ConfigurationError(
                "cell.peg.upper_spheres", self.upper_spheres, f"a whole number from {_LEAST_SPHERES} to 512, or 0"
            )
        radius_mm = self.diameter_mm / 2 + self.clearance_mm + SURFACE_BEGINS_MM
        least = ceil(pi / acos(1.0 - SURFACE_BEGINS_MM / radius_mm))
        if self.cross_section == "round" and 0 < self.outer_boxes < least:
            raise ConfigurationError(
                "cell.peg.outer_boxes",
                self.outer_boxes,
                f"a whole number from {least} to 512, or 0; fewer boxes would reach into the hole",
            )


@dataclass(frozen=True)
class ComplianceConfig(Settings):
    """Springs of the gripper, between force sensor and peg. Encoders cannot see them."""

    TABLE: ClassVar[str] = "cell.compliance"

    lateral_N_per_mm: Annotated[float, Range(1.0, 1000.0)] = 40.0
    """Stiffness across the tool axis."""
    axial_N_per_mm: Annotated[float, Range(0.5, 1000.0)] = 5.0
    """Stiffness along the tool axis."""
    tilt_Nm_per_rad: Annotated[float, Range(1.0, 2000.0)] = 50.0
    """Stiffness against tilting."""
    torsion_Nm_per_rad: Annotated[float, Range(1.0, 2000.0)] = 50.0
    """Stiffness against turning about the tool axis."""
    centre_above_tip_mm: Annotated[float, Range(-50.0, 140.0)] = 0.0
    """Height of the centre of compliance above the peg tip; 0 is a remote-centre-compliance device."""
    damping_ratio: Annotated[float, Range(0.05, 5.0)] = 0.7
    """Damping of each spring, as a share of critical damping."""
    moving_mass_kg: Annotated[float, Range(0.05, 2.0)] = 0.3
    """Mass of gripper and peg, which the sensor feels as weight."""


@dataclass(frozen=True)
class SensorConfig(Settings):
    """Errors of the wrist sensor and the encoders."""

    TABLE: ClassVar[str] = "cell.sensor"

    force_noise_N: Annotated[float, Range(0.0, 100.0)] = 0.1
    """Standard deviation of each force sample, white."""
    torque_noise_Nm: Annotated[float, Range(0.0, 100.0)] = 0.004
    """Standard deviation of each torque sample, white."""
    force_bias_N: Annotated[float, Range(0.0, 100.0)] = 1.0
    """Standard deviation of the constant force offset, drawn anew for each trial."""
    torque_bias_Nm: Annotated[float, Range(0.0, 100.0)] = 0.05
    """Standard deviation of the constant torque offset, drawn anew for each trial."""
    encoder_counts_share: Annotated[float, Range(0.0, 1000.0)] = 1.0
    """Encoder step as a share of the arm's own (0 for ideal encoders)."""


@dataclass(frozen=True)
class CellConfig(Settings):
    """The simulated work cell: what the core does not know and has to find out by touch."""

    TABLE: ClassVar[str] = "cell"

    peg: PegConfig = field(default_factory=PegConfig)
    compliance: ComplianceConfig = field(default_factory=ComplianceConfig)
    sensor: SensorConfig = field(default_factory=SensorConfig)
    conditions: ConditionsConfig = field(default_factory=ConditionsConfig)
    hole_uncertainty_mm: Annotated[float, Range(0.0, 50.0)] = 0.0
    """The true hole lies anywhere within this distance of the nominal goal, drawn anew for each trial."""
    hole_height_error_mm: Annotated[float, Range(-5.0, 5.0)] = 0.0
    """How much higher the plate really is than believed."""
    tilt_mrad: Annotated[float, Range(0.0, 100.0)] = 0.0
    """Tilt of the peg in the gripper against the hole's axis."""
    tilt_heading_deg: Annotated[float, Range(-360.0, 360.0)] = 0.0
    """Direction in which it leans, from x towards y of the task frame."""
    contour: ContourConfig = field(default_factory=ContourConfig)
    contacts: Annotated[str, OneOf("listed", "searched")] = "listed"
    """listed: only what can touch near the hole is tried there, with the same result; searched: MuJoCo tries all."""
    substeps: Annotated[int, Range(3, 100)] = 4
    """Physics steps per control tick (140 Hz): 4 is a time step of 1/560 s."""

    @property
    def hole_reach_mm(self) -> float:
        """How far from the nominal goal the hole may lie."""
        return self.hole_uncertainty_mm + self.conditions.hole_shift_mm

    @property
    def worn_clearance_mm(self) -> float:
        """The clearance once all wear is done."""
        return self.peg.clearance_mm + self.conditions.wear_mm

    @override
    def check(self) -> None:
        if self.contour.shape != FLAT and self.contacts != "searched":
            raise ConfigurationError("cell.contacts", self.contacts, "searched, beside a contour")
        if not 0.001 <= self.worn_clearance_mm <= 5.0:
            accepted = f"a number that leaves a clearance of 0.001 to 5 beside {self.peg.clearance_mm:g}"
            raise ConfigurationError(self.conditions.dotted("wear_mm"), self.conditions.wear_mm, accepted)
