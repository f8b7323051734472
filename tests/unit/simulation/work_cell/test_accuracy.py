"""What costs accuracy is told in a line; the cell that comes, and polygons with any number of spheres, have none."""

import pytest

from palpate.simulation.work_cell.accuracy import accuracy_lines
from palpate.simulation.work_cell.config import CellConfig, PegConfig
from palpate.simulation.work_cell.contour import ContourConfig


@pytest.mark.parametrize(
    ("cell", "told"),
    [
        (CellConfig(), []),
        (CellConfig(peg=PegConfig(cross_section="square", rim_spheres=36)), []),
        (CellConfig(peg=PegConfig(rim_spheres=36)), ["cell.peg.rim_spheres = 36 beside cell.peg.wall_boxes = 48: "]),
        (CellConfig(substeps=3), ["cell.substeps = 3: "]),
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
