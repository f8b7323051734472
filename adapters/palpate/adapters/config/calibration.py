"""Measurements from a rig, and a function that writes them to the rig file without losing its other contents."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

from palpate.adapters.files import read_text, write_whole
from palpate.core.errors import OutputError
from palpate.core.job import ToolConfig
from palpate.core.ports import Range, Settings, Vector3

_GRAVITY_M_S2: Final = 9.81


@dataclass(frozen=True)
class CalibrationTable(Settings):
    """Measurements made by ``palpate rig calibrate`` and used by every run. A value that was not measured is None."""

    TABLE: ClassVar[str] = "calibration"

    weight_N: Annotated[float, Range(0.0, 1000.0)] | None = None
    """Weight of everything attached to the force sensor; replaces tool.mass_kg."""
    centre_of_mass_mm: Vector3 | None = None
    """Centre of mass relative to the sensor's origin, in the tool frame; replaces tool.centre_of_mass_mm."""
    mounting_deg: Annotated[float, Range(-180.0, 180.0)] | None = None
    """Rotation of the sensor about the tool's axis, from x towards y; samples are corrected for it."""
    plate_mm: Annotated[float, Range(-2000.0, 2000.0)] | None = None
    """Height of the plate in the base frame; replaces place.z_mm."""
    hole_mm: tuple[float, float] | None = None
    """Hole position, x and y, in the base frame; replaces place.x_mm and y_mm."""
    axial_stiffness_N_per_mm: Annotated[float, Range(0.1, 1e5)] | None = None
    """Stiffness of the gripper, arm and plate along the tool axis; replaces tool.axial_N_per_mm."""

    def run_settings(self, drawn: ToolConfig) -> dict[str, Any]:
        """Return the measured values as job tables; the tool keeps the moving mass of ``drawn``."""
        place = dict(zip(("x_mm", "y_mm"), self.hole_mm or (), strict=False))
        if self.plate_mm is not None:
            place["z_mm"] = self.plate_mm
        tool: dict[str, Any] = {}
        if self.weight_N is not None:
            tool["mass_kg"] = round(self.weight_N / _GRAVITY_M_S2, 4)
            tool["rigid_mass_kg"] = round(max(tool["mass_kg"] - drawn.moving_mass_kg, 0.0), 4)
        if self.centre_of_mass_mm is not None:
            tool["centre_of_mass_mm"] = self.centre_of_mass_mm
        if self.axial_stiffness_N_per_mm is not None:
            tool["axial_N_per_mm"] = self.axial_stiffness_N_per_mm
        return {name: table for name, table in (("place", place), ("tool", tool)) if table}


def write_into(path: Path, name: str, values: Mapping[str, Any]) -> None:
    """Write values into a table in a TOML file and keep the rest of the file, including comments.

    The old file is replaced only once the new one is complete.

    Raises:
        OutputError: The file cannot be written, or is no longer a TOML file with such a table.
    """
    import tomlkit

    try:
        document = tomlkit.parse(read_text(path, "rig"))
        table: Any = document.setdefault(name, tomlkit.table())
        for key, value in values.items():
            table[key] = list(value) if isinstance(value, tuple) else value
    except (ValueError, TypeError) as error:
        problem = f"takes no values: it was changed meanwhile ({error})"
        raise OutputError(str(path), problem, "correct it, and do the step again") from error
    # If the path is a symbolic link, its target is written.
    write_whole(path.resolve(), tomlkit.dumps(document))
