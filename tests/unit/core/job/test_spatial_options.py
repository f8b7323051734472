"""Options of the insertion in six degrees of freedom, against figures by hand."""

from dataclasses import replace
from math import radians, sin
from typing import Any

import pytest

from palpate.core.job import Job, PartConfig, PlaceConfig, ToolConfig, derived_settings
from palpate.core.ports import SensorFacts
from palpate.core.tasks.insertion_6dof import SpatialOptions

PLACE = PlaceConfig(position_uncertainty_mm=3.0, yaw_uncertainty_deg=5.0)


def options(part: PartConfig, **more: Any) -> dict[str, float]:
    job = replace(Job(part=part, place=PLACE), **more)
    told: dict[str, float] = derived_settings(job, SensorFacts(0.1, 0.004), "insertion-6dof")["task"]["options"]
    return told


@pytest.mark.parametrize(
    ("shape", "corner_mm", "lean_deg", "inside_mm"),
    [
        # Corner of the 29 mm shape; asin(1.8 / corner), 3.6 / corner for a hexagon's near neighbours, at most 12;
        # (3 + 0.7 corner sin 5) / sin(half the corner's angle).
        ("triangle", 29.0, 3.559, 9.539),
        ("square", 20.51, 5.036, 6.012),
        ("rounded-square", 19.26, 5.362, 5.905),
        ("hexagon", 16.74, 12.0, 4.644),
        ("keyed", 11.5, 9.005, 5.235),
    ],
)
def test_lean_and_place_of_each_shape(shape: str, corner_mm: float, lean_deg: float, inside_mm: float) -> None:
    told = options(PartConfig(shape=shape))
    assert (told["corner_mm"], told["lean_deg"], told["inside_mm"]) == pytest.approx(
        (corner_mm, lean_deg, inside_mm), rel=5e-4
    )
    assert told["most_lean_deg"] == max(8.0, told["lean_deg"])


def test_corners_are_let_down_as_deep_whatever_the_size_where_the_lean_is_not_bounded() -> None:
    for part in (PartConfig(shape="square"), PartConfig(shape="triangle", peg_mm=58.0, hole_mm=58.15),
                 PartConfig(shape="hexagon", peg_mm=40.0, hole_mm=40.15)):  # fmt: skip
        assert SpatialOptions(**options(part)).down_m == pytest.approx(0.9 * 1.8e-3, rel=1e-3)
    small = SpatialOptions(**options(PartConfig(shape="square", peg_mm=10.0, hole_mm=10.1)))
    assert small.down_m == pytest.approx(0.9 * 7.071e-3 * sin(radians(12.0)), rel=1e-3)


def test_a_corner_leans_over_the_tilt_of_the_hole() -> None:
    tilted = replace(PLACE, tilt_uncertainty_mrad=70.0)
    # 4.01 degrees and 1.5.
    assert options(PartConfig(shape="triangle"), place=tilted)["lean_deg"] == pytest.approx(5.511, abs=1e-3)


def test_yaw_gives_way_by_the_stiffness_of_the_walls_and_wedged_corners_are_turned_against_friction() -> None:
    told = options(PartConfig(shape="square"))
    # 0.43 of 140 per second, over 50 N m/rad in series with 1.27 x 40 N/mm x (20.51 mm)^2.
    assert told["give_yaw_rad_per_Nms"] == pytest.approx(0.43 * 140.0 * (1 / 50.0 + 1 / 21.36), rel=1e-3)
    # 0.6 x (4.9 N + 2 x 1 N) at the corner.
    assert told["drive_Nm"] == pytest.approx(0.6 * 6.903 * 20.51e-3, rel=1e-3)
    small = options(PartConfig(shape="square", peg_mm=14.5, hole_mm=14.6))
    assert small["give_yaw_rad_per_Nms"] == pytest.approx(0.43 * 140.0 * (1 / 50.0 + 4 / 21.36), rel=1e-3)
    stiff = options(PartConfig(shape="square"), tool=ToolConfig(lateral_N_per_mm=80.0))
    assert stiff["give_yaw_rad_per_Nms"] < told["give_yaw_rad_per_Nms"]
    assert options(PartConfig(shape="square", friction_max=0.3))["drive_Nm"] == pytest.approx(
        0.5 * told["drive_Nm"], rel=1e-3
    )
