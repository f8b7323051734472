"""Estimates of made data: what was put in comes out within its own uncertainty, or is refused by name."""

from math import radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.adapters.experiments.calibration import Estimate, hole, joined, mean_of, payload, press
from palpate.core.errors import UndeterminedError
from palpate.simulation.work_cell import HiddenValues

NOISE = np.array([0.01] * 3 + [0.0004] * 3)
"""Of a mean over two seconds."""


def tilted(tilt_deg, headings=6):
    """Down in the tool's frame, upright and tilted to all sides."""
    angles = np.arange(headings) * 2 * np.pi / max(headings, 1)
    sine, cosine = np.sin(radians(tilt_deg)), np.cos(radians(tilt_deg))
    return np.vstack(
        ([0.0, 0.0, 1.0], np.column_stack((sine * np.cos(angles), sine * np.sin(angles), 0 * angles + cosine)))
    )


def measured(hidden, down, offset, rng):
    rows = [hidden.measured([0.0] * 6, each) for each in down]
    return np.array(rows) + offset + rng.standard_normal((len(down), 6)) * NOISE


@settings(max_examples=25)
@given(st.integers(0, 2**32), st.floats(-180.0, 180.0), st.floats(0.4, 3.0))
def test_load_comes_out_within_its_uncertainty(seed, mounting_deg, mass_kg):
    rng = np.random.default_rng(seed)
    centre, offset = rng.uniform(-0.05, 0.08, 3), rng.uniform(-3.0, 3.0, 6)
    hidden = HiddenValues(gripper_kg=mass_kg, centre_of_mass_m=tuple(centre), mounting_deg=mounting_deg)
    down = tilted(25.0)
    load = payload(down, measured(hidden, down, offset, rng), np.tile(NOISE, (len(down), 1)))
    found = [load.weight_N, *load.centre_of_mass_m]
    for estimate, true in zip(found, [9.81 * mass_kg, *centre], strict=True):
        assert abs(estimate.value - true) < 7.0 * estimate.sd
    away = (load.mounting_deg.value - mounting_deg + 180.0) % 360.0 - 180.0
    assert abs(away) < 7.0 * load.mounting_deg.sd < 1.8


@pytest.mark.parametrize(
    ("down", "mass_kg", "problem"),
    [
        (tilted(25.0, 0), 0.5, "1 poses; what is missing: at least 3, that tilt the tool about two axes"),
        (np.tile([0.0, 0.0, 1.0], (5, 1)), 0.5, "the poses do not determine it"),
        (tilted(1.0), 0.5, "weight is not determined: known to .* N only"),
        (tilted(25.0), 0.02, "is not determined: known to .* only"),
    ],
)
def test_poses_that_determine_no_load_are_refused(down, mass_kg, problem):
    means = measured(HiddenValues(gripper_kg=mass_kg), down, np.zeros(6), np.random.default_rng(1))
    with pytest.raises(UndeterminedError, match=problem):
        payload(down, means, np.tile(NOISE, (len(down), 1)))


def test_cable_that_pulls_is_not_taken_for_a_tool():
    down = tilted(25.0)
    means = measured(HiddenValues(gripper_kg=0.5), down, np.zeros(6), np.random.default_rng(1))
    means[::2, 0] += 2.0
    with pytest.raises(UndeterminedError, match="a tool that no cable pulls"):
        payload(down, means, np.tile(NOISE, (len(down), 1)))


@settings(max_examples=50)
@given(st.integers(0, 2**32), st.floats(2.0, 200.0), st.floats(-0.002, 0.002), st.floats(-0.5, 0.5))
def test_press_gives_surface_and_stiffness_whatever_friction_there_is(seed, stiffness_N_per_mm, surface_m, friction_N):
    rng = np.random.default_rng(seed)
    deep = np.concatenate((np.linspace(1.0, 6.0, 300), np.linspace(6.0, 1.0, 300))) / stiffness_N_per_mm * 1e-3
    direction = np.repeat([1.0, -1.0], 300)
    force = deep * stiffness_N_per_mm * 1e3 + friction_N * direction + 0.1 * rng.standard_normal(600)
    surface, stiffness = press(surface_m + deep, force, direction)
    assert surface.value == pytest.approx(surface_m, abs=7.0 * surface.sd)
    assert stiffness.value == pytest.approx(stiffness_N_per_mm * 1e3, abs=7.0 * stiffness.sd)


def test_force_that_is_no_press_and_hole_that_is_none_are_refused():
    noise, depth = np.random.default_rng(0).standard_normal((100, 6)), np.linspace(0.0, 1e-3, 100)
    with pytest.raises(UndeterminedError, match="force does not grow with depth"):
        press(depth, noise[:, 0], np.ones(100))
    with pytest.raises(UndeterminedError, match="stiffness is not determined: 10 samples"):
        press(depth[:10], noise[:10, 0], np.ones(10))
    with pytest.raises(UndeterminedError, match="hole's x is not determined"):
        hole([(0.4, 0.0), (0.4005, 0.0)], 1e-4)
    with pytest.raises(UndeterminedError, match="at least two"):
        joined("height", [Estimate(1.0, 0.1)], 1.0, "m")
    with pytest.raises(UndeterminedError, match="at least 50: hold the pose longer"):
        mean_of(noise[:20])
