"""Settings of the work cell; their ranges are tried wherever they are declared (tests/unit/adapters/config)."""

from palpate.simulation.work_cell.config import CellConfig


def test_the_defaults_are_the_paper_s_peg_and_hole() -> None:
    peg = CellConfig().peg
    assert (peg.cross_section, peg.diameter_mm, peg.diameter_mm + 2 * peg.clearance_mm) == ("round", 29.0, 29.15)
