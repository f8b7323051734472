"""What costs accuracy is told in a line; the cell that comes, and polygons with any number of spheres, have none."""

import pytest

from palpate.simulation.work_cell.accuracy import accuracy_lines, play_error_mm, valid
from palpate.simulation.work_cell.conditions import ConditionsConfig
from palpate.simulation.work_cell.config import CellConfig, ComplianceConfig, PegConfig
from palpate.simulation.work_cell.contour import ContourConfig


@pytest.mark.parametrize(
    ("cell", "told"),
    [
        (CellConfig(), []),
        (CellConfig(peg=PegConfig(cross_section="square", rim_spheres=36)), []),
        (CellConfig(peg=PegConfig(rim_spheres=36)), ["cell.peg.rim_spheres = 36 beside cell.peg.wall_boxes = 48: "]),
        (CellConfig(substeps=3), ["cell.substeps = 3: "]),
        (
            CellConfig(peg=PegConfig(clearance_mm=0.001)),
            ["outside the simulator's valid range: its play error is 0.9 um "],
        ),
        (CellConfig(tilt_mrad=2.0), []),
        (CellConfig(leaning_impedance=0.95), []),
        (CellConfig(tilt_mrad=2.0, leaning_impedance=0.95), ["cell.leaning_impedance = 0.95 at cell.substeps = 4: "]),
        (CellConfig(tilt_mrad=2.0, substeps=8), ["cell.leaning_impedance = 0.96 at cell.substeps = 8: "]),
        (CellConfig(tilt_mrad=2.0, substeps=8, leaning_impedance=0.965), []),
        (CellConfig(tilt_mrad=2.0, substeps=16, contacts="searched", contour=ContourConfig(shape="sine")), []),
    ],
)
def test_what_costs_accuracy_is_told(cell: CellConfig, told: list[str]) -> None:
    lines = accuracy_lines(cell)
    assert len(lines) == len(told)
    assert all(line.startswith(start) for line, start in zip(lines, told, strict=True))


@pytest.mark.parametrize("diameter_mm", [4.0, 12.0, 29.0, 60.0])
@pytest.mark.parametrize("tilt_mrad", [0.0, 2.0, 4.0])
@pytest.mark.parametrize("clearance_mm", [0.001, 0.003, 0.008, 0.02, 0.075, 0.3])
@pytest.mark.parametrize("section", ["round", "square"])
def test_the_valid_range_ends_between_3_and_8_micrometres(
    diameter_mm: float, tilt_mrad: float, clearance_mm: float, section: str
) -> None:
    for depth_mm in (10.0, 30.0):
        peg = PegConfig(
            cross_section=section, diameter_mm=diameter_mm, clearance_mm=clearance_mm, hole_depth_mm=depth_mm
        )
        assert valid(CellConfig(peg=peg, tilt_mrad=tilt_mrad)) == (clearance_mm >= 0.008)


def test_what_makes_walls_softer_or_looser_makes_the_play_error_larger() -> None:
    cell = CellConfig()
    for worse in (
        CellConfig(compliance=ComplianceConfig(moving_mass_kg=0.1)),
        CellConfig(peg=PegConfig(wall_boxes=16, rim_spheres=16)),
        CellConfig(conditions=ConditionsConfig(yaw_deg=2.0)),
    ):
        assert play_error_mm(worse) > play_error_mm(cell)


def test_a_cell_without_a_hole_has_no_play_error() -> None:
    cell = CellConfig(peg=PegConfig(clearance_mm=0.001), contacts="searched", contour=ContourConfig(shape="sine"))
    assert play_error_mm(cell) == 0.0
    assert accuracy_lines(cell) == []
