"""Accuracy of a cell's contacts: play error and range of validity.

Figures are in docs/results.md.
"""

from math import cos, pi, radians
from typing import Final

from palpate.simulation.work_cell.config import CellConfig
from palpate.simulation.work_cell.contact_impedance import VALID_SHARE, give_mm
from palpate.simulation.work_cell.contour import FLAT

_IDEAL_MM: Final = 0.0008
"""Maximum roughness Ra of a ground pin according to ISO 8734, which ideal circles neglect."""


def play_error_mm(cell: CellConfig) -> float:
    """Return the maximum error of the radial clearance between peg and hole in mm, or 0 without a hole.

    It is the sum of the wall penetration, the play between contacts around the hole, the gap between facets of a peg
    that is turned in its round hole, and the neglected roughness.
    """
    if cell.contour.shape != FLAT:
        return 0.0
    peg, error_mm = cell.peg, give_mm(cell) + _IDEAL_MM
    if peg.cross_section == "round":
        turned_rad = min(radians(cell.conditions.yaw_deg), pi / peg.facets[0])
        error_mm += peg.clearance_mm * (1.0 / cos(pi / peg.contacts_around) - 1.0)
        error_mm += 0.5 * peg.diameter_mm * (1.0 - cos(turned_rad))
    return error_mm


def valid(cell: CellConfig) -> bool:
    """Return True if the play error is small compared with the clearance."""
    return play_error_mm(cell) < VALID_SHARE * cell.peg.clearance_mm or cell.contour.shape != FLAT


def validity_lines(cell: CellConfig) -> list[str]:
    """Return a warning that applies to all results from the cell, or an empty list if the cell is valid."""
    error = f"{play_error_mm(cell) * 1e3:.1f} um of a radial clearance of {cell.peg.clearance_mm * 1e3:g} um"
    line = f"outside the simulator's valid range: its play error is {error} (limit {VALID_SHARE:.0%})"
    return [] if valid(cell) else [line]
