"""Physical parameters of the simulated work cell, in engineering units."""

from dataclasses import dataclass, field
from math import acos, ceil, cos, pi, radians
from typing import Annotated, ClassVar, Final

from typing_extensions import override

from palpate.core.job import KEYED, ROUNDED, SIDES
from palpate.core.ports import OneOf, Range, Settings
from palpate.simulation.work_cell.conditions import ConditionsConfig
from palpate.simulation.work_cell.contour import FLAT, ContourConfig
from palpate.simulation.work_cell.cross_section import CrossSection

SURFACE_BEGINS_MM: Final = 3.0
"""Distance from a round hole at which the broad boxes of the plate's surface begin."""
MOST_FORCE_N: Final = 30.0
"""Lateral force at the tip for the shaft check, equal to the default force limit of a task."""
PLATE_REACH_M: Final = 0.009
"""Minimum distance from the hole's edge to the edge of the closed surface, on which the peg may move."""
_LEAST_SPHERES: Final = 12
_TURNED_DEG: Final = 10.0
"""Expected rotation of the searching peg in addition to that of the hole."""


@dataclass(frozen=True)
class PegConfig(Settings):
    """The peg and the hole of the simulated cell."""

    TABLE: ClassVar[str] = "cell.peg"

    cross_section: Annotated[str, OneOf("round", *SIDES)] = "round"
    """Shape of the peg and hole: round, triangle, square, hexagon, rounded-square, or keyed (round with a flat)."""
    corner_radius_mm: Annotated[float, Range(0.2, 50.0)] = 3.0
    """Radius of the corners of a rounded square."""
    flat_mm: Annotated[float, Range(0.1, 50.0)] = 3.0
    """Height of the segment that the flat of a keyed peg removes."""
    contact: Annotated[str, OneOf("hull", "spheres")] = "hull"
    """hull: a peg with sides is one solid body; spheres: it has contact spheres like a round peg."""
    diameter_mm: Annotated[float, Range(1.0, 100.0)] = 29.0
    """Diameter of the peg, or of its inscribed circle for a polygon."""
    clearance_mm: Annotated[float, Range(0.001, 5.0)] = 0.075
    """Radial clearance: half the difference between the diameters."""
    hole_depth_mm: Annotated[float, Range(0.5, 80.0)] = 10.0
    """Depth of the hole's floor below the plate's surface."""
    friction: Annotated[float, Range(0.0, 2.0)] = 0.2
    """Coulomb friction coefficient between the peg and the plate."""
    wall_boxes: Annotated[int, Range(16, 512)] = 48
    """Number of boxes in the wall of a round hole; a polygon has one per side, a hull with round parts half as many."""
    outer_boxes: Annotated[int, Range(0, 512)] = 16
    """Number of boxes in the plate's surface more than 3 mm from a round hole; 0 uses half of wall_boxes."""
    rim_spheres: Annotated[int, Range(12, 512)] = 48
    """Number of spheres in the contact ring at the peg's tip; a hull with round parts has half as many corners."""
    upper_spheres: Annotated[int, Range(0, 512)] = 24
    """Number of spheres in the second ring, 8 mm above the first; 0 uses rim_spheres."""
    rim_radius_mm: Annotated[float, Range(0.01, 1.0)] = 0.1
    """Radius of these spheres, which also acts as a tiny chamfer, even on hulls."""
    chamfer_mm: Annotated[float, Range(0.0, 10.0)] = 0.0
    """Chamfer of 45 degrees at the peg's end, which makes a round peg a hull; 0 uses rim_radius_mm."""

    def section(self, clearance_mm: float = 0.0) -> CrossSection:
        """Return the outline of the peg, or of the hole if its clearance is passed."""
        radius_mm = self.diameter_mm * 0.5 + clearance_mm
        corner_mm = self.corner_radius_mm + clearance_mm if self.cross_section == ROUNDED else 0.0
        flat_m = (radius_mm - self.flat_mm) * 1e-3 if self.cross_section == KEYED else None
        return CrossSection(SIDES.get(self.cross_section, 0), radius_mm * 1e-3, corner_mm * 1e-3, flat_m)

    def play_mm(self, worn_clearance_mm: float) -> float:
        """Return the maximum distance in mm between possible positions of the peg's axis in a worn hole's mouth."""
        sides, clearance_mm = SIDES.get(self.cross_section, 0), max(self.clearance_mm, worn_clearance_mm)
        across_mm = 2.0 * clearance_mm
        if sides:
            # With an odd number of corners, a corner is opposite a side.
            across_mm *= cos(0.5 * pi / sides * (sides % 2)) / cos(pi / sides)
        return across_mm

    @property
    def is_hull(self) -> bool:
        """Return True if the peg makes contact as one convex body."""
        return self.contact == "hull" and (self.cross_section in SIDES or self.chamfer_mm > 0.0)

    @property
    def walls(self) -> int:
        """Return the number of walls of the hole."""
        return self.section().facets(self.facets[0])

    @property
    def facets(self) -> tuple[int, int]:
        """Return the numbers of walls and peg corners in round parts; a hull uses half as many as configured."""
        return (self.wall_boxes // 2, self.rim_spheres // 2) if self.is_hull else (self.wall_boxes, self.rim_spheres)

    @property
    def contacts_around(self) -> int:
        """Return the minimum number of contacts around a round peg."""
        return min(self.facets[0], self.upper_spheres or self.rim_spheres)

    @override
    def check(self) -> None:
        accepted = f"a whole number from {_LEAST_SPHERES} to 512, or 0"
        self.require("upper_spheres", not 0 < self.upper_spheres < _LEAST_SPHERES, accepted)
        half_mm, rounded = self.diameter_mm / 2, self.cross_section in (ROUNDED, KEYED)
        for name, least, most, where in (
            ("corner_radius_mm", 0.2, half_mm, self.cross_section == ROUNDED),
            ("flat_mm", 0.1, half_mm, self.cross_section == KEYED),
            ("chamfer_mm", 0.0, half_mm / 2, True),
        ):
            accepted = f"a number from {least:g} to less than {most:g} on a peg of {self.diameter_mm:g} mm"
            self.require(name, not where or getattr(self, name) < most, accepted)
        spheres = self.contact != "spheres" or not (rounded or self.chamfer_mm)
        self.require("contact", spheres, "hull, with such a shape or a chamfer")
        radius_mm = half_mm + self.clearance_mm + SURFACE_BEGINS_MM
        fewest = ceil(pi / acos(1.0 - SURFACE_BEGINS_MM / radius_mm))
        enough = not (rounded or self.cross_section == "round") or not 0 < self.outer_boxes < fewest
        accepted = f"a whole number from {fewest} to 512, or 0; fewer boxes would reach into the hole"
        self.require("outer_boxes", enough, accepted)


@dataclass(frozen=True)
class ComplianceConfig(Settings):
    """Springs of the gripper, between the force sensor and the peg. Encoders cannot measure their deflection."""

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
    """Height of the centre of compliance above the peg tip; 0 corresponds to a remote-centre-compliance device."""
    damping_ratio: Annotated[float, Range(0.05, 5.0)] = 0.7
    """Damping of each spring, as a fraction of critical damping."""
    moving_mass_kg: Annotated[float, Range(0.01, 20.0)] = 0.3
    """Mass of the gripper and the peg; the sensor measures its weight."""
    centre_of_mass_above_tip_mm: Annotated[float, Range(5.0, 500.0)] = 50.0
    """Height h of that mass above the peg tip. Its inertia is 0.6 m h^2 across the tool and 0.06 m h^2 along it."""
    rigid_mass_kg: Annotated[float, Range(0.001, 10.0)] = 0.05
    """Mass between the sensor and the springs, which the sensor also measures; its radius of gyration is 20 mm."""


@dataclass(frozen=True)
class SensorConfig(Settings):
    """Errors of the wrist sensor and the encoders."""

    TABLE: ClassVar[str] = "cell.sensor"

    force_noise_N: Annotated[float, Range(0.0, 100.0)] = 0.1
    """Standard deviation of the white force noise per sample."""
    torque_noise_Nm: Annotated[float, Range(0.0, 100.0)] = 0.004
    """Standard deviation of the white torque noise per sample."""
    force_bias_N: Annotated[float, Range(0.0, 100.0)] = 1.0
    """Standard deviation of the constant force offset, drawn for each trial."""
    torque_bias_Nm: Annotated[float, Range(0.0, 100.0)] = 0.05
    """Standard deviation of the constant torque offset, drawn for each trial."""
    encoder_counts_share: Annotated[float, Range(0.0, 1000.0)] = 1.0
    """Encoder step as a fraction of the arm's own step; 0 selects ideal encoders."""


@dataclass(frozen=True)
class CellConfig(Settings):
    """Simulated work cell. The core has no access to these values and must find them by touch."""

    TABLE: ClassVar[str] = "cell"

    peg: PegConfig = field(default_factory=PegConfig)
    compliance: ComplianceConfig = field(default_factory=ComplianceConfig)
    sensor: SensorConfig = field(default_factory=SensorConfig)
    conditions: ConditionsConfig = field(default_factory=ConditionsConfig)
    hole_uncertainty_mm: Annotated[float, Range(0.0, 50.0)] = 0.0
    """Maximum distance of the true hole from the nominal goal, drawn for each trial."""
    hole_height_error_mm: Annotated[float, Range(-5.0, 5.0)] = 0.0
    """Height of the plate above its nominal height."""
    tilt_mrad: Annotated[float, Range(0.0, 100.0)] = 0.0
    """Tilt of the peg in the gripper relative to the hole's axis."""
    tilt_heading_deg: Annotated[float, Range(-360.0, 360.0)] = 0.0
    """Direction of the tilt, from x towards y of the task frame."""
    contour: ContourConfig = field(default_factory=ContourConfig)
    contacts: Annotated[str, OneOf("listed", "searched")] = "listed"
    """listed: check only pairs that can touch near the hole, with the same result; searched: check all pairs."""
    substeps: Annotated[int, Range(3, 100)] = 4
    """Physics steps per control tick (140 Hz): 4 gives a time step of 1/560 s."""
    tilted_impedance: Annotated[float, Range(0.9, 0.98)] = 0.96
    """Initial impedance of contacts (MuJoCo's first solimp) if the peg or plate is tilted, else 0.95. A tight hole,
    whose walls would yield too much, has a special impedance."""

    @property
    def tilts(self) -> bool:
        """Return True if one side of a lowered peg touches the plate first; never true for a ball."""
        return self.contour.shape == FLAT and (self.tilt_mrad > 0.0 or self.conditions.plate_tilt_mrad > 0.0)

    @property
    def has_shaft(self) -> bool:
        """Return True if the shaft of a round peg can tilt enough to touch the mouth of the hole; True for any hull.

        At depth l the walls allow a tilt of 2 c / l. Grip and plate tilt the peg, and a lateral force F bends the
        gripper by F l / k.
        """
        peg = self.peg
        bend_mrad = MOST_FORCE_N * peg.hole_depth_mm / self.compliance.tilt_Nm_per_rad
        slack_mm = 1e-3 * (self.total_tilt_mrad + bend_mrad) * peg.hole_depth_mm - 2.0 * peg.clearance_mm
        return slack_mm > 0.0 and self.contour.shape == FLAT and peg.cross_section == "round" and not peg.is_hull

    @property
    def total_tilt_mrad(self) -> float:
        """Return the maximum angle between the axes of the free peg and the hole."""
        return self.tilt_mrad + self.conditions.plate_tilt_mrad

    @property
    def hole_reach_mm(self) -> float:
        """Return the maximum distance from the nominal goal to the hole."""
        return self.hole_uncertainty_mm + self.conditions.hole_shift_mm

    def plate_reach_m(self, wander_m: float) -> float:
        """Return the distance in m from the hole to the edge of the closed plate, for a peg that moves this far."""
        reach_m = max(PLATE_REACH_M, wander_m + self.hole_reach_mm * 1e-3 + 1e-3)
        if not (sides := self.peg.section().sides) or not self.conditions.yaw_deg:
            return reach_m
        # A corner extends beyond the hole's sides while the peg is turned relative to it.
        swing_rad = min(radians(self.conditions.yaw_deg + _TURNED_DEG), pi / sides)
        half_m = self.peg.diameter_mm * 0.5e-3
        return reach_m + half_m * (cos(pi / sides - swing_rad) / cos(pi / sides) - 1.0)

    @property
    def worn_clearance_mm(self) -> float:
        """Return the clearance after wear."""
        return self.peg.clearance_mm + self.conditions.wear_mm

    @override
    def check(self) -> None:
        searched = self.contour.shape == FLAT or self.contacts == "searched"
        self.require("contacts", searched, "searched, with a contour")
        accepted = f"a number that leaves a clearance of 0.001 to 5 with {self.peg.clearance_mm:g}"
        self.conditions.require("wear_mm", 0.001 <= self.worn_clearance_mm <= 5.0, accepted)
