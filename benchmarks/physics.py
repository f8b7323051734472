"""Prints the physical figures of the simulated cell: ``python -m benchmarks.physics`` from the repository's root.

The figures are those that ``tests/integration/physics`` sets limits to, taken with more headings and also for other
resolutions, time steps and grippers than the default.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import mujoco
import numpy as np

from palpate.adapters.config.run import RunConfig
from palpate.core.motion.arm import ARMS
from palpate.simulation.work_cell.config import ComplianceConfig, PegConfig
from tests.integration.physics.bench import OFFSETS_M, Bench, headings, quiet, rms

FLAT_M = 6e-3


@dataclass(frozen=True)
class Case:
    """A kind of cell to take figures of."""

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
HALVED = Case("10 substeps", partial(quiet, substeps=10))
DOUBLED = resolution(96, 96)
CYLINDER = Case("plain cylinder for a peg", partial(quiet, contacts="searched"), plain_cylinder=True)
RESOLUTIONS = [resolution(boxes, spheres) for boxes in (64, 128) for spheres in (36, 72)]
CENTRES = [centre(height_mm) for height_mm in (0.0, 10.0, 40.0, 140.0)]


def collide_as_a_plain_cylinder(model: mujoco.MjModel) -> None:
    """Let the peg's visual cylinder collide in place of its spheres, with their contact parameters."""
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


def cue(bench: Bench, count: int, after_a_step: bool) -> Iterator[str]:
    """RMS and largest error of the direction, and the lever of the force, at each offset."""
    for offset_m in OFFSETS_M:
        if after_a_step and offset_m < 0.5e-3:
            yield ""  # the step itself would lead through the hole
            continue
        errors, levers = [], []
        for heading in headings(count):
            # The golden angle again, so that steps come from all sides at all headings.
            errors.append(bench.cue_error_deg(offset_m, heading, 2.1 * heading if after_a_step else None))
            levers.append(bench.cue_lever_m() * 1e3)
        yield f"{rms(errors):.2f} / {max(map(abs, errors)):.1f} / {np.mean(levers):.1f}"


def contact(bench: Bench, count: int) -> Iterator[str]:
    """Sinking, ripple, play and capture."""
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


def table(title: str, columns: list[str], cases: list[Case], figures: Callable[[Bench], Iterator[str]]) -> None:
    print(f"\n{title}\n\n| Arm | Cell | {' | '.join(columns)} |\n|---|---|{'---|' * len(columns)}")
    for arm in ARMS:
        for case in cases:
            with bench_of(case, arm) as bench:
                print(f"| {arm} | {case.label} | {' | '.join(figures(bench))} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the default cell only, and fewer headings")
    quick = parser.parse_args().quick
    count = 12 if quick else 24
    offsets = [f"{offset_m * 1e3:g} mm" for offset_m in OFFSETS_M]
    table(
        "Direction to the hole, pressing at rest: RMS error in degrees / largest / lever in mm",
        offsets,
        [DEFAULT] if quick else [DEFAULT, HALVED, DOUBLED, *RESOLUTIONS, CYLINDER, *CENTRES],
        lambda bench: cue(bench, count, after_a_step=False),
    )
    table(
        "The same when an exploratory step of 0.5 mm has just ended",
        offsets,
        CENTRES[:1] if quick else CENTRES,
        lambda bench: cue(bench, count, after_a_step=True),
    )
    table(
        "Contact",
        [
            "penetration, um",
            "rest height, um",
            "ripple, N",
            "play, um",
            "capture half-width at 5 mm/s, um",
        ],
        [DEFAULT, HALVED] if quick else [DEFAULT, HALVED, DOUBLED],
        lambda bench: contact(bench, count),
    )


if __name__ == "__main__":
    main()
