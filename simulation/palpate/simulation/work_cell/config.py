"""The physical parameters of the simulated work cell, in the units an engineer would write them in."""

from __future__ import annotations

from dataclasses import dataclass, field

from palpate.core.errors import require_in, require_one_of, require_whole


@dataclass(frozen=True)
class PegConfig:
    """Peg and hole."""

    cross_section: str = "round"
    """Shape of peg and hole: round, triangle, square, hexagon."""
    diameter_mm: float = 29.0
    """Diameter of the peg; of its inscribed circle where it is a polygon."""
    clearance_mm: float = 0.075
    """Gap between peg and hole all round when centred: half the difference of the diameters."""
    hole_depth_mm: float = 10.0
    """Depth of the hole's floor below the plate's surface."""
    friction: float = 0.2
    """Coulomb friction between peg and plate."""
    wall_boxes: int = 48
    """Boxes that form the wall of a round hole (a polygon has one per side)."""
    rim_spheres: int = 48
    """Small spheres that form each contact ring of the peg."""
    rim_radius_mm: float = 0.1
    """Radius of those spheres: it is also a tiny chamfer."""

    def __post_init__(self) -> None:
        require_one_of("cell.peg.cross_section", self.cross_section, ("round", "triangle", "square", "hexagon"))
        require_in("cell.peg.diameter_mm", self.diameter_mm, 1.0, 100.0)
        require_in("cell.peg.clearance_mm", self.clearance_mm, 0.001, 5.0)
        require_in("cell.peg.hole_depth_mm", self.hole_depth_mm, 0.5, 60.0)
        require_in("cell.peg.friction", self.friction, 0.0, 2.0)
        require_whole("cell.peg.wall_boxes", self.wall_boxes, 16, 512)
        require_whole("cell.peg.rim_spheres", self.rim_spheres, 12, 512)
        require_in("cell.peg.rim_radius_mm", self.rim_radius_mm, 0.01, 1.0)


@dataclass(frozen=True)
class ComplianceConfig:
    """Springs of the gripper, between force sensor and peg. Encoders cannot see them."""

    lateral_N_per_mm: float = 40.0
    """Stiffness across the tool axis."""
    axial_N_per_mm: float = 5.0
    """Stiffness along the tool axis."""
    tilt_Nm_per_rad: float = 50.0
    """Stiffness against tilting."""
    torsion_Nm_per_rad: float = 50.0
    """Stiffness against turning about the tool axis."""
    centre_above_tip_mm: float = 0.0
    """Height of the centre of compliance above the peg tip; 0 is a remote-centre-compliance device."""
    damping_ratio: float = 0.7
    """Damping of each spring, as a share of critical damping."""
    moving_mass_kg: float = 0.3
    """Mass of gripper and peg, which the sensor feels as weight."""

    def __post_init__(self) -> None:
        name = "cell.compliance."
        require_in(name + "lateral_N_per_mm", self.lateral_N_per_mm, 1.0, 1000.0)
        require_in(name + "axial_N_per_mm", self.axial_N_per_mm, 0.5, 1000.0)
        require_in(name + "tilt_Nm_per_rad", self.tilt_Nm_per_rad, 1.0, 2000.0)
        require_in(name + "torsion_Nm_per_rad", self.torsion_Nm_per_rad, 1.0, 2000.0)
        require_in(name + "centre_above_tip_mm", self.centre_above_tip_mm, -50.0, 140.0)
        require_in(name + "damping_ratio", self.damping_ratio, 0.05, 5.0)
        require_in(name + "moving_mass_kg", self.moving_mass_kg, 0.05, 2.0)


@dataclass(frozen=True)
class SensorConfig:
    """Errors of the wrist sensor and the encoders."""

    force_noise_N: float = 0.1
    """Standard deviation of each force sample, white."""
    torque_noise_Nm: float = 0.004
    """Standard deviation of each torque sample, white."""
    force_bias_N: float = 1.0
    """Standard deviation of the constant force offset, drawn anew for each trial."""
    torque_bias_Nm: float = 0.05
    """Standard deviation of the constant torque offset, drawn anew for each trial."""
    encoder_counts_share: float = 1.0
    """Encoder step as a share of the arm's own (0 for ideal encoders)."""

    def __post_init__(self) -> None:
        for name in ("force_noise_N", "torque_noise_Nm", "force_bias_N", "torque_bias_Nm"):
            require_in("cell.sensor." + name, getattr(self, name), 0.0, 100.0)
        require_in("cell.sensor.encoder_counts_share", self.encoder_counts_share, 0.0, 1000.0)


@dataclass(frozen=True)
class CellConfig:
    """The simulated work cell: what the core does not know and has to find out by touch."""

    peg: PegConfig = field(default_factory=PegConfig)
    compliance: ComplianceConfig = field(default_factory=ComplianceConfig)
    sensor: SensorConfig = field(default_factory=SensorConfig)
    hole_uncertainty_mm: float = 0.0
    """The true hole lies anywhere within this distance of the nominal goal, drawn anew for each trial."""
    hole_height_error_mm: float = 0.0
    """How much higher the plate really is than believed."""
    tilt_mrad: float = 0.0
    """Tilt of the peg in the gripper against the hole's axis."""
    tilt_heading_deg: float = 0.0
    """Direction in which it leans, from x towards y of the task frame."""
    substeps: int = 5
    """Physics steps per control tick (140 Hz): 5 is a time step of 1/700 s."""

    def __post_init__(self) -> None:
        require_in("cell.hole_uncertainty_mm", self.hole_uncertainty_mm, 0.0, 50.0)
        require_in("cell.hole_height_error_mm", self.hole_height_error_mm, -5.0, 5.0)
        require_in("cell.tilt_mrad", self.tilt_mrad, 0.0, 100.0)
        require_in("cell.tilt_heading_deg", self.tilt_heading_deg, -360.0, 360.0)
        require_whole("cell.substeps", self.substeps, 3, 100)
