"""Where points and arrows of forces come to lie in a picture, and the library that draws it."""

import subprocess

import numpy as np
import pytest

from palpate.adapters.mujoco import arrow_pixels, graphics, metres_per_N, reference_N
from palpate.adapters.mujoco.views import View, close_up, whole_arm

MOUTH = np.array([0.4, 0.01, 0.02])


def test_target_is_in_the_middle_and_lengths_have_the_scale():
    view = View((0.4, 0.0, 0.02), 0.5, 90.0, 0.0)
    assert view.pixel_of(np.array([0.4, 0.0, 0.02]), 640, 480) == pytest.approx((320.0, 240.0))
    scale = view.pixels_per_m(480)
    # From behind -y one sees x to the right and z up.
    assert view.pixel_of(np.array([0.41, 0.0, 0.05]), 640, 480) == pytest.approx(
        (320 + 0.01 * scale, 240 - 0.03 * scale)
    )


@pytest.mark.parametrize("diameter_m", [0.005, 0.029, 0.1])
def test_close_up_holds_peg_and_hole_whatever_their_size(diameter_m):
    view = close_up(MOUTH, diameter_m)
    assert view.cut
    for sign in (-1.0, 1.0):
        x, y = view.pixel_of(MOUTH + np.array([sign * diameter_m / 2, 0.0, 0.0]), 640, 480)
        assert abs(x - 320) == pytest.approx(77.4, abs=1.0)
        assert 240 < y < 320


def test_whole_arm_is_within_its_picture():
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.1, 0.7], [0.4, -0.2, 0.5], [0.4, 0.0, 0.02]])
    view = whole_arm(points)
    pixels = np.array([view.pixel_of(point, 300, 300) for point in points])
    assert pixels.min() > 10
    assert pixels.max() < 290
    assert np.ptp(pixels, axis=0).max() > 150


VIEW = View((0.4, 0.0, 0.02), 0.25, 90.0, 0.0)


@pytest.mark.parametrize(
    ("largest", "reference"),
    [(0.0, 0.5), (2.0, 1.0), (3.9, 1.0), (4.0, 2.0), (7.4, 2.0), (10.0, 5.0), (39.0, 10.0), (1e6, 5e5)],
)
def test_reference_is_a_round_number_of_about_half_the_largest_force(largest, reference):
    assert reference_N([0.3, largest]) == reference
    assert reference_N([]) == 0.5


def test_arrow_is_as_long_as_its_force_and_points_along_it():
    foot = np.array([0.4, 0.0, 0.02])
    scale = metres_per_N(2.0, VIEW)
    begin, up = arrow_pixels(VIEW, (640, 480), foot, np.array([0.0, 0.0, 4.0]), scale)
    _, aside = arrow_pixels(VIEW, (640, 480), foot, np.array([2.0, 0.0, 0.0]), scale)
    assert begin == pytest.approx((320.0, 240.0))
    assert up == pytest.approx((320.0, 240.0 - 0.2 * 480))
    assert aside == pytest.approx((320.0 + 0.1 * 480, 240.0))


def only(*working):
    return lambda library: "" if library in working else f"no {library} here"


@pytest.mark.parametrize(
    ("named", "working", "taken"),
    [
        ("", ("egl", "osmesa"), "egl"),
        ("", ("osmesa",), "osmesa"),
        ("osmesa", ("egl", "osmesa"), "osmesa"),
        ("EGL", ("egl", "osmesa"), "egl"),
        ("glfw", ("egl", "osmesa"), "egl"),
    ],
)
def test_first_library_that_works_is_taken_unless_the_environment_names_one(monkeypatch, named, working, taken):
    monkeypatch.setattr(graphics, "problem_with", only(*working))
    monkeypatch.setenv("MUJOCO_GL", named)
    assert graphics.working_library() == taken


def test_library_is_tried_in_a_process_of_its_own():
    assert "No module named 'mujoco.nothing'" in graphics.problem_with("nothing")


def test_library_that_hangs_or_crashes_is_no_library(monkeypatch):
    def hang(*words, **more):
        raise subprocess.TimeoutExpired("python", 1.0)

    monkeypatch.setattr(subprocess, "run", hang)
    assert graphics.problem_with("egl") == "does not answer"
    monkeypatch.setattr(subprocess, "run", lambda *words, **more: subprocess.CompletedProcess([], -11, "", ""))
    assert graphics.problem_with("egl") == "ended with -11"
