"""A peg in a tight hole has the play of rigid bodies, stops where statics let it jam, and goes in where they do not."""

from math import cos, sin

import pytest

from palpate.simulation.work_cell.accuracy import play_error_mm
from palpate.simulation.work_cell.config import PegConfig
from tests.support.peg_geometry import overlap
from tests.support.physics_bench import Bench, headings, quiet

PRESS_N, TILT_NM_RAD, HOLE_MM = 4.9, 50.0, 30.0
WALL_N = 10.0


@pytest.mark.parametrize("diameter_mm", [4.0, pytest.param(60.0, marks=pytest.mark.nightly)])
@pytest.mark.parametrize(
    ("clearance_mm", "tilt_mrad"),
    [
        (0.008, 2.0),
        (0.075, 4.0),
        *(pytest.param(*more, marks=pytest.mark.nightly) for more in ((0.008, 0.0), (0.02, 4.0))),
    ],
)
def test_walls_give_way_by_no_more_than_the_stated_error(diameter_mm, clearance_mm, tilt_mrad):
    peg = PegConfig(diameter_mm=diameter_mm, clearance_mm=clearance_mm, hole_depth_mm=HOLE_MM)
    run = quiet(peg=peg, tilt_mrad=tilt_mrad, tilt_heading_deg=70.0)
    error_um, to_m = play_error_mm(run.cell) * 1e3, (clearance_mm + WALL_N / 40.0) * 1e-3
    with Bench(run) as bench:
        for depth_m, ticks in ((5e-3, 130), (25e-3, 305)):
            bench.enter_hole(depth_m, ticks)
            assert bench.play_m(0.0) * 1e6 <= clearance_mm * 1e3 + error_um
            for heading in headings(2):
                bench.push_to(to_m * cos(heading), to_m * sin(heading))
                seen = overlap(bench)
                assert seen.depth_mm == pytest.approx(depth_m * 1e3, abs=0.2)
                assert max(seen.wall_um, seen.mouth_um) <= error_um


@pytest.mark.parametrize(
    ("section", "diameter_mm", "clearance_mm", "tilt_mrad", "friction"),
    [
        ("round", 4.0, 0.008, 4.0, 0.4),
        ("round", 12.0, 0.012, 5.0, 0.3),
        ("round", 60.0, 0.008, 4.0, 0.4),
        ("square", 12.0, 0.02, 6.0, 0.6),
    ],
)
def test_tilted_peg_jams_where_statics_have_it(section, diameter_mm, clearance_mm, tilt_mrad, friction):
    peg = PegConfig(
        cross_section=section, diameter_mm=diameter_mm, clearance_mm=clearance_mm, hole_depth_mm=HOLE_MM,
        friction=friction,
    )  # fmt: skip
    # Two walls hold it by 2 f k (tilt - 2 c / l) / l, which the press no longer overcomes from this depth on.
    jams_mm = next(
        depth_mm
        for depth_mm in (0.01 * hundredth for hundredth in range(1, 3000))
        if 2.0 * friction * TILT_NM_RAD * (tilt_mrad - 2e3 * clearance_mm / depth_mm) / depth_mm > PRESS_N
    )
    with Bench(quiet(peg=peg, tilt_mrad=tilt_mrad, tilt_heading_deg=0.0)) as bench:
        bench.press_into_hole(700)
        assert jams_mm < overlap(bench).depth_mm < 1.5 * jams_mm


@pytest.mark.parametrize(("clearance_mm", "tilt_mrad"), [(0.008, 1.0), (0.02, 2.0)])
def test_peg_that_statics_let_in_goes_down_to_the_floor(clearance_mm, tilt_mrad):
    peg = PegConfig(diameter_mm=12.0, clearance_mm=clearance_mm, hole_depth_mm=HOLE_MM)
    with Bench(quiet(peg=peg, tilt_mrad=tilt_mrad, tilt_heading_deg=70.0)) as bench:
        bench.press_into_hole(500)
        assert abs(overlap(bench).floor_um) <= 2.0


def test_peg_with_a_micrometre_of_clearance_does_not_go_in_tilted():
    peg = PegConfig(clearance_mm=0.001)
    with Bench(quiet(peg=peg, tilt_mrad=4.0)) as bench:
        bench.press_into_hole(500)
        assert overlap(bench).depth_mm < 3.0
