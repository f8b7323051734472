"""Physical properties of the simulated cell: ``python -m benchmarks.physics``.

The properties are those limited by ``tests/integration/physics``, measured at 28 offsets and more headings. They are
also measured for other resolutions, time steps, grippers, shapes, clearances and tilts, up to the edge of the plate.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product

import mujoco
import numpy as np

from benchmarks.common import table
from palpate.adapters.config.run import RunConfig
from palpate.core.job import SIDES
from palpate.core.motion.arm import ARMS
from palpate.simulation.work_cell.config import PLATE_REACH_M, ComplianceConfig, PegConfig
from tests.support.physics_bench import LEAST_OFFSET_M, MOST_OFFSET_M, Bench, headings, quiet, rms

FLAT_M = 6e-3
OFFSETS_M = np.linspace(LEAST_OFFSET_M, MOST_OFFSET_M, 28).tolist()
AFTER_A_STEP_M = (1e-3, 2e-3, 3e-3)
CLEARANCES_MM = (0.02, 0.075, 0.3, 1.0)
TILTS_MRAD = (0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
LEANS = 3
"""Number of tilt headings at each clearance. No heading is used twice."""
Figures = Callable[["Bench"], Iterator[str]]
GRID = ("limits", "sinking, um", "ripple, N", "play less clearance, um")
THROUGH_M = 1e-3
"""Tip depth above which the tip is through the plate. A tilted tip hangs into the hole by less."""


@dataclass(frozen=True)
class Case:
    """A kind of cell to be measured."""

    label: str
    config: Callable[[str], RunConfig]
    plain_cylinder: bool = False


def resolution(boxes: int, spheres: int) -> Case:
    peg = PegConfig(wall_boxes=boxes, rim_spheres=spheres)
    return Case(f"{boxes} boxes, {spheres} spheres", partial(quiet, peg=peg))


def centre(height_mm: float) -> Case:
    compliance = ComplianceConfig(centre_above_tip_mm=height_mm)
    return Case(f"centre of compliance at {height_mm:g} mm", partial(quiet, compliance=compliance))


DEFAULT = Case("default", quiet)
HALVED = Case("8 substeps", partial(quiet, substeps=8))
DOUBLED = resolution(96, 96)
FEWER = Case(
    "32 boxes, 32 spheres, 16 upper", partial(quiet, peg=PegConfig(wall_boxes=32, rim_spheres=32, upper_spheres=16))
)
UNEQUAL = resolution(48, 32)
CYLINDER = Case("plain cylinder for a peg", partial(quiet, contacts="searched"), plain_cylinder=True)
RESOLUTIONS = [resolution(boxes, spheres) for boxes in (64, 128) for spheres in (36, 72)]
CENTRES = [centre(height_mm) for height_mm in (0.0, 10.0, 40.0, 140.0)]


def collide_as_a_plain_cylinder(model: mujoco.MjModel) -> None:
    """Make the peg's visual cylinder collide instead of its spheres, with the same contact parameters."""
    spheres = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE)
    cylinder = next(
        geom
        for geom in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_CYLINDER)
        if model.geom_bodyid[geom] == model.body("peg").id
    )
    for parameter in ("contype", "conaffinity", "condim", "friction", "solref", "solimp"):
        values = getattr(model, f"geom_{parameter}")
        values[cylinder] = values[spheres[0]]
    model.geom_contype[spheres] = model.geom_conaffinity[spheres] = 0
    # The tree of bounding volumes was compiled without geoms that were only to be seen.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE


def bench_of(case: Case, arm: str) -> Bench:
    bench = Bench(case.config(arm))
    if case.plain_cylinder:
        collide_as_a_plain_cylinder(bench.rig.cell.model)
    return bench


def cue(bench: Bench, count: int) -> Iterator[str]:
    """Yield the RMS direction error over all offsets, the RMS at the worst offset, and the maximum error."""
    errors = {
        offset_m: [bench.cue_error_deg(offset_m, heading) for heading in headings(count)] for offset_m in OFFSETS_M
    }
    worst_m = max(OFFSETS_M, key=lambda offset_m: rms(errors[offset_m]))
    everything = [error for each in errors.values() for error in each]
    yield f"{rms(everything):.2f}"
    yield f"{rms(errors[worst_m]):.2f} at {worst_m * 1e3:.1f} mm"
    yield f"{max(map(abs, everything)):.1f}"


def cue_after_a_step(bench: Bench, count: int) -> Iterator[str]:
    """Yield the RMS and maximum direction error at each offset just after an exploratory step."""
    for offset_m in AFTER_A_STEP_M:
        # The golden angle again, so that steps come from all sides at all headings.
        errors = [bench.cue_error_deg(offset_m, heading, 2.1 * heading) for heading in headings(count)]
        yield f"{rms(errors):.2f} / {max(map(abs, errors)):.1f}"


def grid(arm: str, section: str, tilt_mrad: float) -> Iterator[str]:
    """Yield the sinking and ripple from the hole to the plate's edge, and the play, over all clearances and tilts."""
    sinking_um, ripple_N, off_um = [], [], []
    cells = product(CLEARANCES_MM, range(LEANS if tilt_mrad else 1))
    for (clearance_mm, _), tilt in zip(cells, headings(LEANS * len(CLEARANCES_MM)), strict=False):
        peg, clearance_m = PegConfig(cross_section=section, clearance_mm=clearance_mm), clearance_mm * 1e-3
        leaning = {"tilt_mrad": tilt_mrad, "tilt_heading_deg": float(np.degrees(tilt)) % 360.0}
        # At the plate's edge with the low side outwards, inwards and across.
        edge = [(PLATE_REACH_M, tilt + turn) for turn in (0.0, np.pi, 2.0)]
        with Bench(quiet(arm, peg=peg, **leaning)) as bench:
            for aside_m, heading in ((clearance_m + 1e-3, 0.0), (5e-3, 2.4), (FLAT_M, 4.8), *edge):
                bench.press(aside_m * np.cos(heading), aside_m * np.sin(heading))
                sinking_um.append(bench.penetration_m() * 1e6)
                ripple_N.append(bench.ripple_N(40))
                if bench.rig.truth().depth_m > THROUGH_M:
                    raise SystemExit(f"a {section} peg went through the plate {aside_m * 1e3:g} mm beside the hole")
            # No deeper: a body that leans takes up play, by its depth.
            bench.enter_hole(1e-3)
            off_um.append((bench.play_m(0.0) - clearance_m) * 1e6)
    yield "missed" if max(sinking_um) > 5.0 or max(ripple_N) > 0.05 or max(map(abs, off_um)) > 20.0 else "kept"
    yield from (f"{max(sinking_um):.2f}", f"{max(ripple_N):.4f}", f"{min(off_um):.1f} to {max(off_um):.1f}")


def contact(bench: Bench, count: int) -> Iterator[str]:
    """Yield sinking, ripple, play and capture."""
    bench.press(OFFSETS_M[0], 0.0)
    yield f"{bench.penetration_m() * 1e6:.2f}"
    bench.press(FLAT_M, 0.0)
    yield f"{bench.rig.truth().tip_in_task_m[2] * 1e6:.2f}"
    yield f"{bench.ripple_N():.4f}"
    bench.enter_hole(4e-3)
    play_um = [bench.play_m(heading) * 1e6 for heading in headings(count)]
    yield f"{min(play_um):.1f} to {max(play_um):.1f}"
    capture_um = [bench.capture_half_width_m(heading) * 1e6 for heading in headings(count // 3)]
    yield f"{np.mean(capture_um):.0f} ({min(capture_um):.0f} to {max(capture_um):.0f})"


def show(title: str, columns: list[str], arms: list[str], cases: list[Case], figures: Figures) -> None:
    rows = []
    for arm, case in product(arms, cases):
        with bench_of(case, arm) as bench:
            rows.append((arm, case.label, *figures(bench)))
    print(f"\n{title}\n\n{table(('arm', 'cell', *columns), rows)}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the default cell only, and fewer headings")
    parser.add_argument("--arms", nargs="+", default=["zebra-zero", "ur5"], choices=tuple(ARMS))
    parser.add_argument("--grid", action="store_true", help="only shapes, clearances and tilts, checked for the limits")
    parser.add_argument("--shapes", nargs="+", default=["round", *SIDES], help="of the grid")
    parser.add_argument("--tilts-mrad", nargs="+", type=float, default=TILTS_MRAD, help="of the grid")
    options = parser.parse_args()
    quick, count = options.quick, 12 if options.quick else 24
    if options.grid:
        rows = [(*case, *grid(*case)) for case in product(options.arms, options.shapes, options.tilts_mrad)]
        print(table(("arm", "shape", "tilt, mrad", *GRID), rows))
        raise SystemExit(any("missed" in row for row in rows))
    show(
        f"Direction to the hole, pressing, stationary, {len(OFFSETS_M)} offsets from 0.3 to 3 mm: error in degrees",
        ["RMS", "RMS at the worst offset", "largest"],
        options.arms,
        [DEFAULT] if quick else [DEFAULT, HALVED, DOUBLED, FEWER, UNEQUAL, *RESOLUTIONS, CYLINDER],
        lambda bench: cue(bench, count),
    )
    show(
        "RMS / largest error when an exploratory step of 0.5 mm has just ended",
        [f"{offset_m * 1e3:g} mm" for offset_m in AFTER_A_STEP_M],
        options.arms,
        CENTRES[:1] if quick else CENTRES,
        lambda bench: cue_after_a_step(bench, count),
    )
    show(
        "Contact",
        ["penetration, um", "rest height, um", "ripple, N", "play, um", "capture half-width at 5 mm/s, um"],
        options.arms,
        [DEFAULT, HALVED] if quick else [DEFAULT, HALVED, DOUBLED],
        lambda bench: contact(bench, count),
    )


if __name__ == "__main__":
    main()
