"""The torque about the tip tells where the hole is: the cue that the whole task lives on."""

from math import cos, sin

import pytest

from palpate.simulation.work_cell.config import ComplianceConfig
from tests.support.arms import EVERY_ARM
from tests.support.physics_bench import Bench, headings, offsets_m, quiet, rms


@pytest.mark.parametrize("arm", EVERY_ARM)
def test_direction_to_the_hole_errs_by_at_most_5_degrees_rms(arm):
    with Bench(quiet(arm)) as bench:
        errors = [bench.cue_error_deg(*place) for place in zip(offsets_m(18), headings(18), strict=True)]
    assert rms(errors) <= 5.0


@pytest.mark.parametrize("heading", headings(3))
def test_signs_of_force_and_torque(heading):
    # The hole is in the direction e from the tip. The plate pushes from the other side of the tip, upwards (-z).
    ex, ey = -cos(heading), -sin(heading)
    with Bench(quiet()) as bench:
        bench.press(1e-3 * cos(heading), 1e-3 * sin(heading))
        (_, _, fz), (tx, ty, _) = bench.measurement.filtered_wrench_at_tip()
        lever_m = bench.cue_lever_m()
    assert fz == pytest.approx(-bench.press_N, rel=0.01)
    assert (tx / -fz, ty / -fz) == pytest.approx((lever_m * ey, -lever_m * ex), abs=0.1 * lever_m)


def test_friction_turns_the_cue_unless_the_gripper_pivots_at_the_tip():
    def after_steps(centre_above_tip_mm):
        compliance = ComplianceConfig(centre_above_tip_mm=centre_above_tip_mm)
        with Bench(quiet(compliance=compliance)) as bench:
            return rms([bench.cue_error_deg(1e-3, h, step_heading=2.1 * h + 1.0) for h in headings(6)])

    assert after_steps(40.0) > 3.0 * after_steps(0.0)
