"""Settings of a cell that are known to cost its contact accuracy, in words; figures are in docs/results.md."""

from palpate.simulation.work_cell.config import CellConfig

_COARSE_SUBSTEPS = 3
_LEAST_LEANING_IMPEDANCE = ((5, 0.96), (16, 0.965), (100, 0.97))
"""From which impedance on a peg that leans sinks in by no more than 5 um, up to so many substeps."""


def accuracy_lines(cell: CellConfig) -> list[str]:
    """What is to be said of a cell that touches less truly than the one that comes, a line each."""
    peg, lines = cell.peg, []
    if peg.cross_section == "round" and peg.rim_spheres != peg.wall_boxes:
        lines.append(
            f"cell.peg.rim_spheres = {peg.rim_spheres} beside cell.peg.wall_boxes = {peg.wall_boxes}: "
            "the torque points beside the hole by up to 7 degrees RMS (limit 5); equal numbers go together"
        )
    if cell.substeps <= _COARSE_SUBSTEPS:
        lines.append(
            f"cell.substeps = {cell.substeps}: a peg drops into the hole from up to 18 % farther off "
            "than at half the time step (limit 20 %)"
        )
    least = next(least for substeps, least in _LEAST_LEANING_IMPEDANCE if cell.substeps <= substeps)
    if cell.leans and cell.leaning_impedance < least:
        lines.append(
            f"cell.leaning_impedance = {cell.leaning_impedance:g} at cell.substeps = {cell.substeps}: "
            f"a peg that leans sinks into the plate by more than 5 um (limit 5); from {least:g} on it does not"
        )
    return lines
