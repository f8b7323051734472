"""Prints how pegs of each shape touch plate and hole: ``python -m benchmarks.shapes_acceptance`` from the root.

Asked of each: play 75 +- 20 um on faces, sinking at most 5 um, ripple at most 0.05 N, capture across and in yaw that
half the time step changes by at most 20 %, and nothing that goes through the plate. About three minutes of one core.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from math import cos, pi, sin
from time import thread_time

from palpate.simulation.work_cell.config import PLATE_REACH_M, PegConfig
from palpate.simulation.work_cell.cross_section import SIDES
from tests.integration.physics.bench import Bench, headings, quiet

SUBSTEPS = (4, 8)
ACROSS = (0.0, pi / 2, 0.3, 4.0)
"""Headings of passes: along the task's x and y, and two askew."""
COLUMNS = ("play um", "sinking um", "ripple N", "capture x, y, askew um", "in yaw deg", "us a step: pressed, inside")


def cost_us(bench: Bench, substeps: int, ticks: int = 200) -> float:
    begin = thread_time()
    for _ in range(ticks):
        bench.rig.cell.advance()
    return (thread_time() - begin) / ticks / substeps * 1e6


def figures(bench: Bench, section: str, substeps: int) -> Iterator[str]:
    sinking_um, ripple_N = [], []
    for aside_m, heading in zip((1.1e-3, 2e-3, 3.5e-3, 6e-3, PLATE_REACH_M), headings(5), strict=True):
        bench.press(aside_m * cos(heading), aside_m * sin(heading))
        sinking_um.append(bench.penetration_m() * 1e6)
        ripple_N.append(bench.ripple_N())
        if bench.rig.truth().depth_m > 1e-3:
            raise SystemExit(f"a {section} peg went through the plate {aside_m * 1e3:g} mm beside the hole")
    pressed_us = cost_us(bench, substeps)
    play_um = []
    for depth_m in (4e-3, 9.5e-3):
        bench.enter_hole(depth_m)
        play_um.append(bench.play_m(0.0) * 1e6)
        sinking_um.append(bench.penetration_m() * 1e6)
    inside_us = cost_us(bench, substeps)
    yield f"{min(play_um):.1f} to {max(play_um):.1f}"
    yield f"{max(sinking_um):.2f}"
    yield f"{max(ripple_N):.4f}"
    yield ", ".join(f"{bench.capture_half_width_m(heading, 2e-6) * 1e6:.0f}" for heading in ACROSS)
    yield "any" if section == "round" else f"{bench.capture_in_yaw_deg():.2f}"
    yield f"{pressed_us:.0f}, {inside_us:.0f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arm", default="zebra-zero")
    parser.add_argument("--shapes", nargs="*", default=["round", *SIDES])
    parser.add_argument("--chamfer-mm", type=float, default=0.0)
    parser.add_argument("--tilt-mrad", type=float, default=0.0)
    told = parser.parse_args()
    print(f"| shape | steps a tick | {' | '.join(COLUMNS)} |\n|---|---|{'---|' * len(COLUMNS)}")
    for section in told.shapes:
        peg = PegConfig(cross_section=section, chamfer_mm=told.chamfer_mm)
        for substeps in SUBSTEPS:
            leaning = {"tilt_mrad": told.tilt_mrad, "tilt_heading_deg": 70.0}
            with Bench(quiet(told.arm, peg=peg, substeps=substeps, **leaning)) as bench:
                print(f"| {section} | {substeps} | {' | '.join(figures(bench, section, substeps))} |", flush=True)


if __name__ == "__main__":
    main()
