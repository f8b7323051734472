"""Derived settings and the regime, against figures by hand."""

from dataclasses import fields, replace
from math import sqrt

import pytest

from palpate.adapters.config import compose
from palpate.core.job import (
    Constants,
    Job,
    PartConfig,
    PlaceConfig,
    Quantities,
    ToolConfig,
    derive,
    derived_settings,
    jamming_force_N,
    largest_tilt_rad,
    regime_of,
    wall_force_N,
)
from palpate.core.policy.belief import BeliefParameters
from palpate.core.ports import SensorFacts
from palpate.core.supervision import SupervisionConfig
from palpate.core.trial import ControlConfig, TaskConfig
from palpate.simulation.work_cell import CellConfig

QUIET, KNOWN = SensorFacts(0.1, 0.004), Constants()
DOWEL = replace(
    Quantities.of(Job(), QUIET),
    radius_m=6e-3, deviation_m=3e-3, clearance_m=9e-6, depth_m=20e-3, friction=0.4, tilt_rad=4e-3,
    axial_N_per_m=2e4, moving_kg=0.5,
)  # fmt: skip


def regime(job, known=KNOWN, step_m=1e-5):
    return regime_of(job, derive(job, known), step_m=step_m, known=known)


def scaled(value, length, mass, time):
    """The same quantities in other units, by the units in their names."""
    force = mass * length / time**2
    powers = {
        "m": length, "rad": 1.0, "N_per_m": force / length, "Nm_per_rad": force * length, "ratio": 1.0, "kg": mass,
        "N": force, "Nm": force * length, "m_s": length / time, "s": time, "Hz": 1 / time, "m_s2": length / time**2,
        "N_s": force / time, "N_s_per_m": force * time / length, "m_per_N_s": length / force / time,
        "number": 1.0, "friction": 1.0,
    }  # fmt: skip
    names = [field.name for field in fields(value)]
    units = {name: max((u for u in powers if name == u or name.endswith(f"_{u}")), key=len) for name in names}
    return replace(value, **{name: getattr(value, name) * powers[units[name]] for name in names})


class TestRegime:
    def test_wall_force_and_jam_number_by_hand(self):
        # 4 c / theta = 9 mm is on the way: k theta^2 / (8 c) = 50 * 16e-6 / 72e-6 N on each wall.
        assert wall_force_N(DOWEL) == pytest.approx(50.0 * 16e-6 / 72e-6)
        assert jamming_force_N(DOWEL) == pytest.approx(0.8 * 11.1111, rel=1e-4)
        found = regime(DOWEL)
        assert found.jam_number == pytest.approx(8.8889 / 4.903325, rel=1e-4)
        # J above 0.8: the insertion presses with 1.3 J of the press.
        assert derive(DOWEL).insertion_press_N == pytest.approx(1.3 * found.held_N)
        assert found.held_N == pytest.approx(8.8889, rel=1e-4)

    def test_short_hole_ends_before_the_walls_are_loaded_most(self):
        short = replace(DOWEL, depth_m=6e-3)
        assert wall_force_N(short) == pytest.approx(50.0 * (4e-3 - 18e-6 / 6e-3) / 6e-3)
        assert wall_force_N(replace(DOWEL, depth_m=4.4e-3)) == 0.0
        assert wall_force_N(replace(DOWEL, tilt_rad=0.0)) == 0.0

    @pytest.mark.parametrize("depth_m", [6e-3, 20e-3])
    def test_largest_tilt_jams_at_just_that_force(self, depth_m):
        job = replace(DOWEL, depth_m=depth_m)
        tilt_rad = largest_tilt_rad(job, 4.9)
        assert jamming_force_N(replace(job, tilt_rad=tilt_rad)) == pytest.approx(4.9)

    def test_peg_jams_where_friction_first_equals_the_press(self):
        found, press_N = regime(DOWEL), 4.903325
        depth_m = found.jam_depth_m
        assert 4.5e-3 < depth_m < 9e-3
        assert 0.8 * 50.0 * (4e-3 - 18e-6 / depth_m) / depth_m == pytest.approx(press_N)
        assert regime(replace(DOWEL, tilt_rad=1e-3)).jam_depth_m == float("inf")

    def test_inertia_of_a_tool_is_no_unexpected_contact(self):
        assert derive(DOWEL).unexpected_N == 3.0
        # 2 kg at 20 mm/s within 1/140 s, and 9.3 standard deviations of the force.
        heavy = derive(replace(DOWEL, mass_kg=2.0))
        assert (heavy.unexpected_N, heavy.speed_m_s) == (pytest.approx(5.6 + 0.93), 0.02)
        # Half way from noise to the limit of the force: a heavier tool travels more slowly.
        slow = derive(replace(DOWEL, mass_kg=20.0))
        assert (slow.unexpected_N, slow.speed_m_s) == (pytest.approx(15.465), pytest.approx(14.535 / 20.0 / 140.0))

    def test_release_and_contact_within_a_sample_are_no_fault(self):
        straight = replace(DOWEL, tilt_rad=0.0)
        assert derive(straight).rate_N_s == 3000.0
        # 120 N/mm at 20 mm/s and its damper, and noise, within 1/140 s.
        met_N = (120e3 / 140 + 1.4 * sqrt(120e3 * 0.5)) * 0.02
        stiff = derive(replace(straight, lateral_N_per_m=120e3))
        assert stiff.rate_N_s == pytest.approx((met_N + 0.93) * 140.0)
        # A harder press on a peg that jams; no more than the limit of the force in one sample.
        assert derive(DOWEL).rate_N_s == pytest.approx(30.93 * 140.0)

    def test_caught_peg_stops_within_the_force_limit(self):
        # 30 N less 1.3 times the friction, and less the noise; 15 kg stop at v sqrt(k m).
        assert derive(DOWEL).slide_m_s == pytest.approx((30.0 - 0.67 * 4.903325) / sqrt(40e3 * 15.0))
        gentle = derive(replace(DOWEL, force_N=5.0))
        assert gentle.slide_m_s == pytest.approx((5.0 - 0.67 * 2.0) / sqrt(40e3 * 15.0))
        assert gentle.time_s > derive(DOWEL).time_s

    @pytest.mark.parametrize("units", [(1e3, 1.0, 1.0), (1e3, 1e3, 1e3), (39.37, 2.2, 60.0)])
    def test_other_units_give_the_same_settings_and_regime(self, units):
        """(1e3, 1e3, 1e3) are mm, g, ms, so mN is g m / s^2 in these: forces differ by their factor alone."""
        length, mass, _ = units
        job = replace(DOWEL, noise_N=0.3)
        other, known = scaled(job, *units), scaled(Constants(), *units)
        expected = scaled(derive(job), *units)
        assert vars(derive(other, known)) == pytest.approx(vars(expected))
        found = regime(other, known, 1e-5 * length)
        assert vars(found) == pytest.approx(vars(scaled(regime(job), *units)))
        assert mass

    def test_papers_job_gives_the_defaults(self):
        job = Job(place=replace(Job().place, start_uncertainty_mm=3.0))
        tables = derived_settings(job, QUIET, "insertion")
        classes = {"task": TaskConfig(), "control": ControlConfig(), "supervision": SupervisionConfig()}
        classes["learning"] = BeliefParameters()
        tables["learning"] = tables["learning"]["belief"]
        tables["task"].pop("goal")
        for name, defaults in classes.items():
            for field, value in tables[name].items():
                assert value == getattr(defaults, field), (name, field)
        assert compose().cell == CellConfig()
        assert tables["perception"] == {"torque_threshold_kgf_mm": 0.7, "position_threshold_mm": 1.0}


SENSOR = SensorFacts(0.1, 0.004)


class TestCell:
    def test_light_peg_in_a_stiff_gripper_is_simulated_in_shorter_steps(self):
        stiff = replace(ToolConfig(), mass_kg=0.17, rigid_mass_kg=0.05, lateral_N_per_mm=52.4)
        cell = derived_settings(replace(Job(), tool=stiff), SENSOR, "insertion")["cell"]
        # 661 rad/s at 140 Hz, over 0.652 rad.
        assert (cell["substeps"], cell["tilted_impedance"]) == (8, 0.965)
        assert derived_settings(Job(), SENSOR, "insertion")["cell"]["substeps"] == 4

    def test_sensors_range_bounds_the_derived_torque_limit(self):
        weak = replace(SENSOR, range_Nm=(8.0, 5.0, 8.0))
        limits = [
            derived_settings(Job(), sensor, "insertion")["supervision"]["max_torque_Nm"] for sensor in (SENSOR, weak)
        ]
        assert limits == [5.0, 4.5]


TURNED = PlaceConfig(position_uncertainty_mm=3.0, yaw_uncertainty_deg=5.0)


def options(part, **more):
    job = replace(Job(part=part, place=TURNED), **more)
    return derived_settings(job, SensorFacts(0.1, 0.004), "insertion-6dof")["task"]["options"]


class TestSpatialOptions:
    @pytest.mark.parametrize(
        ("shape", "corner_mm", "tilt_deg", "inside_mm"),
        [
            # Corner of the 29 mm shape; asin(0.15 / 0.081 / corner), twice that for a hexagon's neighbours, at most 12;
            # (3 + 0.7 corner sin 5) / sin(half the corner's angle).
            ("triangle", 29.0, 3.661, 9.539),
            ("square", 20.51, 5.181, 6.012),
            ("rounded-square", 19.26, 5.517, 5.905),
            ("hexagon", 16.74, 12.0, 4.644),
            ("keyed", 11.5, 9.267, 5.235),
        ],
    )
    def test_lean_and_place_of_each_shape(self, shape, corner_mm, tilt_deg, inside_mm):
        message = options(PartConfig(shape=shape))
        assert (message["corner_mm"], message["tilt_deg"], message["inside_mm"]) == pytest.approx(
            (corner_mm, tilt_deg, inside_mm), rel=5e-4
        )
        assert message["most_tilt_deg"] == max(8.0, message["tilt_deg"])

    def test_yaw_gives_way_by_the_stiffness_of_the_walls_and_wedged_corners_are_turned_against_friction(self):
        message = options(PartConfig(shape="square"))
        # 0.43 of 140 per second, over 50 N m/rad in series with 1.27 x 40 N/mm x (20.51 mm)^2.
        assert message["push_yaw_rad_per_Nms"] == pytest.approx(0.43 * 140.0 * (1 / 50.0 + 1 / 21.36), rel=1e-3)
        # 0.6 x (4.9 N + 2 x 1 N) at the corner.
        assert message["drive_Nm"] == pytest.approx(0.6 * 6.903 * 20.51e-3, rel=1e-3)
        small = options(PartConfig(shape="square", peg_mm=14.5, hole_mm=14.6))
        assert small["push_yaw_rad_per_Nms"] == pytest.approx(0.43 * 140.0 * (1 / 50.0 + 4 / 21.36), rel=1e-3)
        stiff = options(PartConfig(shape="square"), tool=ToolConfig(lateral_N_per_mm=80.0))
        assert stiff["push_yaw_rad_per_Nms"] < message["push_yaw_rad_per_Nms"]
        assert options(PartConfig(shape="square", friction_max=0.3))["drive_Nm"] == pytest.approx(
            0.5 * message["drive_Nm"], rel=1e-3
        )
