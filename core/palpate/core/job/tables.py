"""Tables in a job file: part, tool, place and limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import cos, hypot, radians
from typing import Annotated, ClassVar, Final, TypeAlias

from typing_extensions import override

from palpate.core.motion import ToolGeometry
from palpate.core.ports import Holds, OneOf, Range, Settings, Vector3

ROUND: Final = "round"
SIDES: Final = {"triangle": 3, "square": 4, "hexagon": 6, "rounded-square": 4, "keyed": 0}
"""Number of sides for each named cross-section; all others are round."""
KEYED: Final = "keyed"
ROUNDED: Final = "rounded-square"
_NM: Final = 6
"""Number of decimals to keep in the difference between two sizes in millimetres, a resolution of one nanometre."""
_MOST_CLEARANCE_MM: Final = 5.0

_MOST_FLAT: Final = 0.8
"""Maximum flat depth divided by the radius; at larger values, less than half the peg remains."""
_LEAST_MM: Final = 1.0
_LEAST_TIP_MM: Final = 5.0
_MOST_BENT_DEG: Final = 80.0
_MOST_ASIDE_MM: Final = 500.0


def _none_or(low: float, high: float) -> Holds:
    """Accept zero, or a range that excludes values given in metres or radians by mistake."""
    return Holds(lambda value: value == 0.0 or low <= value <= high, f"0, or a number from {low:g} to {high:g}")


_Angle: TypeAlias = Annotated[float, Range(-360.0, 360.0)]
_Place: TypeAlias = Annotated[float, Range(-3000.0, 3000.0)]
_Point: TypeAlias = tuple[_Place, _Place, _Place]
_Length: TypeAlias = Annotated[float, Range(-2000.0, 2000.0)]


@dataclass(frozen=True)
class PartConfig(Settings):
    """The part, as specified on its drawing."""

    TABLE: ClassVar[str] = "part"

    shape: Annotated[str, OneOf(ROUND, *SIDES)] = ROUND
    """Cross-section of peg and hole: round, triangle, square, hexagon, rounded-square, or keyed (round with a flat)."""
    peg_mm: Annotated[float, Range(1.0, 100.0)] = 29.0
    """Peg diameter; width across flats if it has sides."""
    hole_mm: Annotated[float, Range(1.002, 110.0)] = 29.15
    """Hole diameter, or width across flats."""
    corner_radius_mm: Annotated[float, Range(0.2, 50.0)] = 3.0
    """Corner radius of a rounded square."""
    flat_mm: Annotated[float, Range(0.1, 50.0)] = 3.0
    """Height of the segment that the flat removes from a keyed peg."""
    chamfer_mm: Annotated[float, _none_or(0.02, 10.0)] = 0.0
    """45-degree chamfer on the peg's end; 0 for a broken edge."""
    depth_mm: Annotated[float, Range(0.5, 60.0)] = 10.0
    """Required insertion depth."""
    hole_depth_mm: Annotated[float, Range(0.0, 80.0)] = 0.0
    """Depth to the hole's floor; 0 uses depth_mm."""
    depth_tolerance_mm: Annotated[float, Range(0.01, 5.0)] = 0.2
    """Tolerance on the reached depth."""
    friction_max: Annotated[float, Range(0.0, 1.5)] = 0.6
    """Maximum coefficient of friction between peg and hole."""

    @property
    def clearance_mm(self) -> float:
        """Return the radial clearance, half the difference between the sizes."""
        return round((self.hole_mm - self.peg_mm) / 2.0, _NM)

    @property
    def floor_mm(self) -> float:
        """Return the depth to the hole's floor."""
        return self.hole_depth_mm or self.depth_mm

    def describe(self) -> str:
        """Return the sizes and the fit on one line, as on a drawing."""
        unit = "" if self.shape == ROUND else f"{self.shape} "
        return (
            f"{unit}peg {self.peg_mm:.3f} mm, hole {self.hole_mm:.3f} mm, radial clearance {self.clearance_mm:.3f} mm,"
            f" depth {self.depth_mm:g} mm"
        )

    @override
    def check(self) -> None:
        half_mm, most_mm = self.peg_mm / 2.0, self.peg_mm + 2.0 * _MOST_CLEARANCE_MM
        fits = f"from {self.peg_mm + 0.002:g} to {most_mm:g} for part.peg_mm = {self.peg_mm:g}"
        allowed = 0.001 <= self.clearance_mm <= _MOST_CLEARANCE_MM
        self.require("hole_mm", allowed, f"{fits} (radial clearance 0.001 to 5 mm)")
        self.require("hole_depth_mm", self.floor_mm >= self.depth_mm, f"at least part.depth_mm = {self.depth_mm:g}")
        is_small = self.depth_tolerance_mm < self.depth_mm
        self.require("depth_tolerance_mm", is_small, f"below part.depth_mm = {self.depth_mm:g}")
        for name, most, applies in (
            ("corner_radius_mm", half_mm, self.shape == ROUNDED),
            ("flat_mm", _MOST_FLAT * half_mm, self.shape == KEYED),
            ("chamfer_mm", half_mm / 2.0, True),
        ):
            accepted = f"below {most:g} on a peg of {self.peg_mm:g} mm"
            self.require(name, not applies or getattr(self, name) < most, accepted)


@dataclass(frozen=True)
class ToolConfig(Settings):
    """The tool on the arm's flange: a force sensor, and a gripper holding the peg.

    The sensor's z axis points out of the tool. All stiffnesses apply at the tip.
    """

    TABLE: ClassVar[str] = "tool"

    sensor_mm: tuple[_Length, _Length, _Length] = (0.0, 0.0, 30.0)
    """Origin of the force sensor's frame relative to the flange, in the flange's axes with z along the tool."""
    sensor_rpy_deg: tuple[_Angle, _Angle, _Angle] = (0.0, 0.0, 0.0)
    """Roll, pitch and yaw of the force sensor's frame relative to the flange."""
    tip_mm: tuple[_Length, _Length, _Length] = (0.0, 0.0, 140.0)
    """Centre of the peg's end face relative to the sensor's origin, in the sensor's frame."""
    tip_rpy_deg: tuple[_Angle, _Angle, _Angle] = (0.0, 0.0, 0.0)
    """Roll, pitch and yaw of the peg in the sensor's frame; its axis is the tip's z."""
    mass_kg: Annotated[float, Range(0.06, 20.0)] = 0.35
    """Mass of everything on the force sensor, as measured by palpate rig calibrate."""
    rigid_mass_kg: Annotated[float, Range(0.0, 20.0)] = 0.05
    """Mass fixed rigidly to the sensor; the rest moves on the gripper's compliance."""
    centre_of_mass_mm: tuple[_Length, _Length, _Length] = (0.0, 0.0, 77.142857)
    """Centre of mass in the sensor's frame."""
    axial_N_per_mm: Annotated[float, Range(0.5, 1000.0)] = 5.0
    """Gripper stiffness along the tool axis, at the tip."""
    lateral_N_per_mm: Annotated[float, Range(1.0, 1000.0)] = 40.0
    """Stiffness across the tool axis."""
    tilt_Nm_per_rad: Annotated[float, Range(1.0, 2000.0)] = 50.0
    """Stiffness against tilting."""
    torsion_Nm_per_rad: Annotated[float, Range(1.0, 2000.0)] = 50.0
    """Stiffness against turning about the tool axis."""
    damping_ratio: Annotated[float, Range(0.05, 5.0)] = 0.7
    """Gripper damping as a fraction of critical damping."""

    @property
    def geometry(self) -> ToolGeometry:
        """Return the poses of the sensor and the tip relative to the flange, in metres and radians."""
        return ToolGeometry(
            _metres(self.sensor_mm), _radians(self.sensor_rpy_deg), _metres(self.tip_mm), _radians(self.tip_rpy_deg)
        )

    @property
    def moving_mass_kg(self) -> float:
        """Return the mass that the compliant gripper supports."""
        return round(self.mass_kg - self.rigid_mass_kg, 9)

    @property
    def centre_above_tip_mm(self) -> float:
        """Return the height of the centre of mass above the tip, along the tool."""
        return round(self.tip_mm[2] - self.centre_of_mass_mm[2], _NM)

    @property
    def moving_centre_above_tip_mm(self) -> float:
        """Return the height of the compliant part's centre of mass above the tip; the rigid part is at the sensor."""
        return round(self.tip_mm[2] - self.centre_of_mass_mm[2] * self.mass_kg / self.moving_mass_kg, 3)

    @override
    def check(self) -> None:
        lighter = f"at least 0.01 below tool.mass_kg = {self.mass_kg:g}"
        self.require("rigid_mass_kg", self.moving_mass_kg >= 0.01, lighter)
        for name in ("sensor_mm", "tip_mm", "centre_of_mass_mm"):
            accepted = f"zeros, or at least {_LEAST_MM:g} away: the numbers are millimetres"
            self.require(name, not any(getattr(self, name)) or hypot(*getattr(self, name)) >= _LEAST_MM, accepted)
        beyond = f"a third number of {_LEAST_TIP_MM:g} at least: the tip is beyond the sensor"
        self.require("tip_mm", self.tip_mm[2] >= _LEAST_TIP_MM, beyond)
        roll_deg, pitch_deg, _ = self.tip_rpy_deg
        is_straight = cos(radians(roll_deg)) * cos(radians(pitch_deg)) >= cos(radians(_MOST_BENT_DEG))
        accepted = f"a peg that points away from the sensor, at most {_MOST_BENT_DEG:g} degrees off its axis"
        self.require("tip_rpy_deg", is_straight, accepted)
        x_mm, y_mm, z_mm = self.centre_of_mass_mm
        along = f"the third number from 0 to {self.tip_mm[2]:g} as in tool.tip_mm"
        accepted = f"a place on the tool: {along}, the first two at most {_MOST_ASIDE_MM:g}"
        on_tool = 0.0 <= z_mm <= self.tip_mm[2] and hypot(x_mm, y_mm) <= _MOST_ASIDE_MM
        self.require("centre_of_mass_mm", on_tool, accepted)


@dataclass(frozen=True)
class PlaceConfig(Settings):
    """Nominal hole pose and its uncertainty."""

    TABLE: ClassVar[str] = "place"

    x_mm: _Place = 400.0
    """Forward distance from the arm's base to the hole's mouth."""
    y_mm: _Place = 0.0
    """Leftward distance from the arm's base to the hole's mouth."""
    z_mm: _Place = 20.0
    """Height of the plate surface above the base."""
    further_mm: tuple[_Point, ...] = ()
    """Centres (x, y, z) of more holes like this one; a run's trials use them in turn."""
    rpy_deg: tuple[_Angle, _Angle, _Angle] = (0.0, 0.0, 0.0)
    """Roll, pitch and yaw of the hole about the base axes; all 0 if it points straight down."""
    position_uncertainty_mm: Annotated[float, _none_or(0.02, 20.0)] = 0.0
    """Maximum lateral deviation of the hole from its nominal position."""
    height_uncertainty_mm: Annotated[float, _none_or(0.01, 5.0)] = 0.5
    """Maximum error in the plate's height."""
    tilt_uncertainty_mrad: Annotated[float, _none_or(0.05, 100.0)] = 0.0
    """Maximum angle between the peg and hole axes."""
    yaw_uncertainty_deg: Annotated[float, _none_or(0.1, 45.0)] = 0.0
    """Maximum rotation of the hole about its axis relative to the peg."""
    start_uncertainty_mm: Annotated[float, _none_or(0.02, 20.0)] = 0.0
    """Maximum distance from the nominal hole to a trial's start; drawn for each trial."""

    @property
    def centres_mm(self) -> tuple[Vector3, ...]:
        """Return all hole centres, (x, y, z) each."""
        return (self.x_mm, self.y_mm, self.z_mm), *self.further_mm


@dataclass(frozen=True)
class LimitsConfig(Settings):
    """Process limits."""

    TABLE: ClassVar[str] = "limits"

    force_N: Annotated[float, Range(1.0, 500.0)] = 30.0
    """Maximum force on the part."""
    drawn_from_N: Annotated[float, _none_or(1.0, 500.0)] = 0.0
    """Minimum force limit in training, where simulated trials draw limits up to force_N; 0 disables this."""
    speed_mm_s: Annotated[float, Range(1.0, 100.0)] = 20.0
    """Maximum tip speed in free space."""
    lag_ms: Annotated[float, Range(0.0, 500.0)] = 10.0
    """The arm's lag behind its commands; a longer lag requires slower force control."""


@dataclass(frozen=True)
class Job(Settings):
    """A job without its arm, as four tables."""

    part: PartConfig = field(default_factory=PartConfig)
    tool: ToolConfig = field(default_factory=ToolConfig)
    place: PlaceConfig = field(default_factory=PlaceConfig)
    limits: LimitsConfig = field(default_factory=LimitsConfig)

    @override
    def check(self) -> None:
        part, place = self.part, self.place
        least_mm = place.height_uncertainty_mm + part.depth_tolerance_mm
        accepted = f"more than {least_mm:g} = place.height_uncertainty_mm + part.depth_tolerance_mm"
        is_deep = part.depth_mm > least_mm
        part.require("depth_mm", is_deep, f"{accepted}, as deep as the plate itself may be taken to lie")
        accepted = f"at most part.peg_mm = {part.peg_mm:g}: measure the hole's place first"
        limits, accepted_N = self.limits, f"at most limits.force_N = {self.limits.force_N:g}"
        limits.require("drawn_from_N", limits.drawn_from_N <= limits.force_N, accepted_N)
        place.require("position_uncertainty_mm", place.position_uncertainty_mm <= part.peg_mm, accepted)


JOB_TABLES: Final = ("part", "tool", "place", "limits")
"""Job file tables other than ``arm`` and ``cell``."""
STATED: Final[Mapping[str, tuple[str, ...]]] = {
    "part": ("peg_mm", "hole_mm", "depth_mm"),
    "tool": (
        *("sensor_mm", "tip_mm", "mass_kg", "centre_of_mass_mm"),
        *("axial_N_per_mm", "lateral_N_per_mm", "tilt_Nm_per_rad"),
    ),
    "place": ("x_mm", "y_mm", "z_mm"),
}
"""Fields that every job must specify, because no default is safe."""


def _metres(mm: Vector3) -> Vector3:
    x, y, z = mm
    return x * 1e-3, y * 1e-3, z * 1e-3


def _radians(deg: Vector3) -> Vector3:
    x, y, z = deg
    return radians(x), radians(y), radians(z)
