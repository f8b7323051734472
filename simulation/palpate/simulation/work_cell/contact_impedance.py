"""Contact impedance that is high enough for a tight hole.

A MuJoCo contact with impedance d and time constant T yields by at most (1 - d) / d T^2 F / m under a force F on a mass
m. The walls of a tight hole must yield less. With contacts that are hard at the surface, a wedged peg would bounce from
wall to wall and slip, so these contacts harden gradually over a thin skin.
"""

from math import pi, sqrt
from typing import Final

from palpate.simulation.work_cell.config import CellConfig

CONTACT_TIME_S: Final = 0.003
VALID_SHARE: Final = 0.25
"""Maximum ratio of play error to clearance. The relative error of a wedging force is then about that of friction."""
_UPRIGHT: Final = 0.95
_DEEP: Final = 0.99, 1e-4  # impedance in depth, and the depth in metres
_SKIN: Final = 0.1
"""Ratio of skin depth to clearance. With a larger ratio, a peg jams deeper than statics predicts."""
_DEEPEST_SKIN_MM: Final = 0.004  # a peg may sink into the plate by 5 um
_SURFACE: Final = 0.5
"""Impedance at the surface of the skin: with 0.3 to 0.7 a peg jams as statics predicts; with 0.8 it slips."""
_HARDEST: Final = 0.9999  # MuJoCo's own limit
_PRESS_N: Final = 4.9
"""Default pressing force of a task; lateral pushes are not larger."""


def contact_impedance(cell: CellConfig) -> tuple[float, float, float, float, float]:
    """Return MuJoCo's solimp for all contacts between the peg and the plate."""
    if not is_tight(cell):
        return _plain(cell), *_DEEP, 0.5, 2.0
    skin_mm = _skin_mm(cell)
    # For a single contact. All contacts together yield by half the skin, so the skin is never fully compressed.
    alone_mm = max(0.5 * skin_mm, (0.5 * skin_mm) ** 1.5 * sqrt(2.0 / cell.peg.clearance_mm) / _spacing(cell))
    hard = 1.0 / (1.0 + (skin_mm if cell.peg.is_hull else alone_mm) / _softness_mm(cell))
    return _SURFACE, min(hard, _HARDEST), skin_mm * 1e-3, 0.5, 2.0


def is_tight(cell: CellConfig) -> bool:
    """Return True if plain walls would yield by more than half of the limit for a valid cell."""
    return _give_mm(cell, _plain(cell)) > 0.5 * VALID_SHARE * cell.peg.clearance_mm


def give_mm(cell: CellConfig) -> float:
    """Return the depth by which the walls of the hole yield to the peg."""
    return max(_skin_mm(cell), _give_mm(cell, _HARDEST)) if is_tight(cell) else _give_mm(cell, _plain(cell))


def wedge_force_N(cell: CellConfig) -> float:
    """Return the maximum wall force on a tilted peg as it descends: k (tilt - 2 c / l) / l."""
    tilt, c_mm, depth_mm = cell.total_tilt_mrad * 1e-3, cell.peg.clearance_mm, cell.peg.hole_depth_mm
    at_mm = min(depth_mm, 4.0 * c_mm / tilt) if tilt else depth_mm
    return max(1e3 * cell.compliance.tilt_Nm_per_rad * (tilt - 2.0 * c_mm / at_mm) / at_mm, 0.0)


def _plain(cell: CellConfig) -> float:
    """Return the impedance for looser fits. With 0.95, the few contact points of a tilted peg would sink in too far."""
    return cell.tilted_impedance if cell.tilts else _UPRIGHT


def _skin_mm(cell: CellConfig) -> float:
    return min(_SKIN * cell.peg.clearance_mm, _DEEPEST_SKIN_MM)


def _give_mm(cell: CellConfig, impedance: float) -> float:
    """Return the yield depth for an impedance, with a gap of c (1 - cos a) at angle a from the deepest contact."""
    alone = (1.0 - impedance) / impedance * _softness_mm(cell)
    shared: float = (_spacing(cell) * alone) ** (2.0 / 3.0) * (cell.peg.clearance_mm / 2.0) ** (1.0 / 3.0)
    # A hull rests on two points.
    return 0.5 * alone if cell.peg.is_hull else min(alone, shared)


def _softness_mm(cell: CellConfig) -> float:
    """Return T^2 F / m for the lateral force: the pressing force and the wedging force that it can overcome."""
    wedge_N, friction = wedge_force_N(cell), cell.peg.friction
    held_N = min(wedge_N, _PRESS_N / (2.0 * friction)) if friction else wedge_N
    return 1e3 * CONTACT_TIME_S**2 * (_PRESS_N + held_N) / cell.compliance.moving_mass_kg


def _spacing(cell: CellConfig) -> float:
    """Return three quarters of the angle between contacts around the hole, a result of integrating the shared force."""
    return 1.5 * pi / cell.peg.contacts_around
