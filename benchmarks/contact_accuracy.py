"""Comparison of a round peg in tight holes with rigid geometry: ``python -m benchmarks.contact_accuracy``.

Noise is off. Each peg is pressed on the plate, moved into its hole and pushed sideways at several depths, moved over
the hole, and pressed in. Other pegs are pressed in until they jam. Overlaps are those of an ideal cylinder and an ideal
hole at the true pose, which would be zero for rigid bodies. Each row gives the maximum over all depths and headings.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import product
from math import cos, sin

from benchmarks.common import table
from palpate.core.ports import CONTROL_RATE_HZ
from palpate.simulation.work_cell import play_error_mm, valid
from palpate.simulation.work_cell.config import PegConfig
from palpate.simulation.work_cell.contact_impedance import wedge_force_N
from tests.support.peg_geometry import overlap
from tests.support.physics_bench import Bench, headings, quiet

DIAMETERS_MM = (4.0, 12.0, 29.0, 60.0)
CLEARANCES_MM = (0.001, 0.008, 0.02, 0.075)
TILTS_MRAD = (0.0, 2.0, 4.0)
DEPTHS_MM = (2.0, 5.0, 12.0, 25.0)
HOLE_MM = 30.0
TRAVEL_MM_S = 16.0
BENT_MM = 0.25
"""Distance beyond the wall to which the peg is commanded. Its springs then push it with 10 N."""
JAMMED_MM = 1.0
COLUMNS = (
    "mm", "c, um", "tilt, mrad", "play error, um", "rim in wall, um", "shaft in mouth, um", "pressed on plate, um",
    "tilt beyond 2c/l, mrad", "stands at, mm", "floor, um", "drop width less c and edge, um", "stated, um", "valid",
)  # fmt: skip


JAM_COLUMNS = ("shape", "mm", "c, um", "tilt, mrad", "friction", "J", "jams at by statics, mm", "stands at, mm")
JAMS = (
    ("round", 12.0, 0.008, 4.0, 0.1), ("round", 12.0, 0.02, 4.0, 0.3), ("round", 4.0, 0.008, 4.0, 0.4),
    ("round", 12.0, 0.008, 4.0, 0.4), ("round", 29.0, 0.008, 4.0, 0.4), ("round", 60.0, 0.008, 4.0, 0.4),
    ("round", 12.0, 0.012, 5.0, 0.3), ("round", 29.0, 0.02, 6.0, 0.6), ("square", 12.0, 0.008, 4.0, 0.4),
    ("square", 29.0, 0.02, 6.0, 0.6), ("hexagon", 12.0, 0.008, 4.0, 0.4), ("keyed", 12.0, 0.012, 5.0, 0.3),
)  # fmt: skip


def row(diameter_mm: float, clearance_mm: float, tilt_mrad: float, arm: str) -> Iterator[str]:
    """Yield the results for one peg."""
    peg = PegConfig(diameter_mm=diameter_mm, clearance_mm=clearance_mm, hole_depth_mm=HOLE_MM)
    cell = quiet(arm, peg=peg, tilt_mrad=tilt_mrad, tilt_heading_deg=70.0)
    yield from (f"{diameter_mm:g}", f"{clearance_mm * 1e3:g}", f"{tilt_mrad:g}")
    with Bench(cell) as bench:
        bench.press(clearance_mm * 1e-3 + 1e-3, 0.0)
        pressed_um = bench.penetration_m() * 1e6
        play_um, wall_um, mouth_um, beyond_mrad = [], [], [], []
        for depth_mm in DEPTHS_MM:
            bench.enter_hole(depth_mm * 1e-3, ticks_down(depth_mm))
            if overlap(bench).depth_mm < depth_mm - JAMMED_MM:
                break  # it is held by more than the walls can be asked to bear: springs that are bent by 5 N/mm
            play_um.append(bench.play_m(0.0) * 1e6 - clearance_mm * 1e3)
            for heading in headings(3):
                to_m = (clearance_mm + BENT_MM) * 1e-3
                bench.push_to(to_m * cos(heading), to_m * sin(heading))
                seen = overlap(bench)
                wall_um.append(seen.wall_um)
                mouth_um.append(seen.mouth_um)
                beyond_mrad.append(seen.total_tilt_mrad - 2.0 * clearance_mm / seen.depth_mm * 1e3)
        bench.press_into_hole(4 * ticks_down(HOLE_MM))
        stationary = overlap(bench)
        # A tilted peg's middle comes as near to the floor as its rim allows, which is what the overlap counts.
        floor = f"{stationary.floor_um:.1f}" if stationary.depth_mm > HOLE_MM - JAMMED_MM else "-"
        dropped_um = bench.capture_half_width_m(0.5, 2e-6) * 1e6 - (clearance_mm + peg.rim_radius_mm) * 1e3
    # A tilted peg has less play by geometry, as its shaft takes some.
    yield f"{max(play_um):.2f}" if play_um and not tilt_mrad else "-"
    yield from (f"{max(each):.2f}" if each else "-" for each in (wall_um, mouth_um))
    yield f"{pressed_um:.2f}"
    yield f"{max(beyond_mrad):.2f}" if beyond_mrad else "-"
    yield from (f"{stationary.depth_mm:.1f}", floor, f"{dropped_um:.0f}")
    yield from (f"{play_error_mm(cell.cell) * 1e3:.1f}", "yes" if valid(cell.cell) else "no")


def jam(section: str, diameter_mm: float, clearance_mm: float, tilt_mrad: float, friction: float) -> Iterator[str]:
    """Yield the depth at which a pressed peg can jam according to statics, and the depth at which it stops."""
    peg = PegConfig(
        cross_section=section, diameter_mm=diameter_mm, clearance_mm=clearance_mm, hole_depth_mm=HOLE_MM,
        friction=friction, corner_radius_mm=diameter_mm / 6, flat_mm=diameter_mm / 6,
    )  # fmt: skip
    cell = quiet(peg=peg, tilt_mrad=tilt_mrad).cell
    with Bench(quiet(peg=peg, tilt_mrad=tilt_mrad)) as bench:
        bench.press_into_hole(4 * ticks_down(HOLE_MM))
        stands_mm, press_N = overlap(bench).depth_mm, bench.press_N
    share = 2.0 * friction * wedge_force_N(cell) / press_N
    depths_mm = (0.01 * hundredth for hundredth in range(1, int(100 * HOLE_MM)))
    stiffness = cell.compliance.tilt_Nm_per_rad
    held_mm = next(
        (z for z in depths_mm if 2 * friction * stiffness * (tilt_mrad - 2e3 * clearance_mm / z) / z > press_N), HOLE_MM
    )
    yield from (section, f"{diameter_mm:g}", f"{clearance_mm * 1e3:g}", f"{tilt_mrad:g}", f"{friction:g}")
    yield from (f"{share:.2f}", f"{held_mm:.1f}", f"{stands_mm:.1f}")


def ticks_down(depth_mm: float) -> int:
    """Return the number of ticks that a free peg needs to arrive and settle."""
    return int((depth_mm + 3.0) / TRAVEL_MM_S * CONTROL_RATE_HZ) + 60


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arm", default="zebra-zero")
    parser.add_argument("--diameters-mm", nargs="+", type=float, default=DIAMETERS_MM)
    parser.add_argument("--clearances-mm", nargs="+", type=float, default=CLEARANCES_MM)
    parser.add_argument("--tilts-mrad", nargs="+", type=float, default=TILTS_MRAD)
    options = parser.parse_args()
    pegs = product(options.diameters_mm, options.clearances_mm, options.tilts_mrad)
    print(table(COLUMNS, [tuple(row(*peg, options.arm)) for peg in pegs]))
    print(f"\nWhere a tilted peg jams\n\n{table(JAM_COLUMNS, [tuple(jam(*each)) for each in JAMS])}")


if __name__ == "__main__":
    main()
