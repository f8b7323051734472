"""What was measured on a rig, and how it gets into the rig file without anything being lost."""

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
    """What ``palpate rig calibrate`` measured, and every run uses. None is not measured."""

    TABLE: ClassVar[str] = "calibration"

    weight_N: Annotated[float, Range(0.0, 1000.0)] | None = None
    """Weight of all that hangs on the force sensor; instead of tool.mass_kg."""
    centre_of_mass_mm: Vector3 | None = None
    """Its centre of mass, from the sensor's origin, frame of the tool; instead of tool.centre_of_mass_mm."""
    mounting_deg: Annotated[float, Range(-180.0, 180.0)] | None = None
    """Turn of the sensor about the tool's axis, from x towards y; its samples are turned back by it."""
    plate_mm: Annotated[float, Range(-2000.0, 2000.0)] | None = None
    """Height of the plate, base frame; instead of place.z_mm."""
    hole_mm: tuple[float, float] | None = None
    """Place of the hole, x and y, base frame; instead of place.x_mm and y_mm."""
    axial_stiffness_N_per_mm: Annotated[float, Range(0.1, 1e5)] | None = None
    """Stiffness along the tool, of gripper, arm and plate; instead of tool.axial_N_per_mm."""

    def run_settings(self, drawn: ToolConfig) -> dict[str, Any]:
        """The tables of a job that this replaces.

        Args:
            drawn: The tool as the job has it. What its gripper's moving part weighs stays: the rest is at the sensor.
        """
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


def write_into(path: Path, tables: Mapping[str, Mapping[str, Any]]) -> None:
    """Put values into a TOML file: what else is in it stays, comments too. The old file is there until the new one is.

    Raises:
        OutputError: It cannot be written, or is no TOML file with such tables any more.
    """
    import tomlkit
    from tomlkit.items import InlineTable

    try:
        document = tomlkit.parse(read_text(path, "rig"))
        for name, values in tables.items():
            table: Any = document
            for part in name.split("."):
                if part not in table:
                    table[part] = tomlkit.inline_table() if isinstance(table, InlineTable) else tomlkit.table()
                table = table[part]
            for key, value in values.items():
                table[key] = list(value) if isinstance(value, tuple) else value
    except (ValueError, TypeError) as error:
        problem = f"takes no values: it was changed meanwhile ({error})"
        raise OutputError(str(path), problem, "correct it, and do the step again") from error
    # The file itself, where it is a link.
    write_whole(path.resolve(), tomlkit.dumps(document))
