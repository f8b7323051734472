"""The example of a task in a package of its own follows a surface, finds a faulty sensor, is recorded and replayed."""

import importlib
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from palpate.adapters.config import task_kind
from palpate.core.control_loop import run_trial
from palpate.core.trial import ControlConfig, Outcome, TaskConfig
from tests.unit.core.fake_world import FakeWorld, measurement, tip_motion

PACKAGE = Path(__file__).parents[2] / "examples" / "surface_follow"
TASK = "surface_follow:SURFACE_FOLLOW"
WAY = {"stroke_mm": 6.0, "way_mm": 9.0}


@pytest.fixture(autouse=True)
def installed(monkeypatch):
    """The package can be imported, as an installed one can."""
    monkeypatch.syspath_prepend(str(PACKAGE))
    yield
    sys.modules.pop("surface_follow", None)
    task_kind.cache_clear()


def followed(world, **options):
    task, example = TaskConfig(name=TASK, options=WAY | options), importlib.import_module("surface_follow")
    follow = example.FollowTask(task, ControlConfig(damping_N_s_per_m=100.0), measurement(), tip_motion())
    with world:
        return run_trial(follow, world.ports, example.SURFACE_FOLLOW.setup(task, 1, 0))


def sloping(slope):
    world = FakeWorld()
    world.slope = slope
    return world


@pytest.mark.parametrize("slope", [0.0, 0.1, -0.1])
def test_a_slope_is_led_ahead_of_the_force(slope):
    led, yielding = (followed(sloping(slope), lead_ahead=lead) for lead in (1.0, 0.0))
    assert (led.outcome, yielding.outcome) == (Outcome.DONE, Outcome.DONE)
    rms_N = [float(report.events[-1].detail.split(" m, ")[1].split()[0]) for report in (led, yielding)]
    # Without the lead the damping law needs an error to move at all: 100 N s/m times 2 mm/s.
    assert rms_N[0] < 0.1
    assert rms_N[1] == pytest.approx(abs(slope) * 0.02 * 100.0, abs=0.05)
    assert [event.name for event in led.events].count("verified") >= 2


def test_an_error_above_the_tolerance_is_no_success():
    report = followed(sloping(0.1), lead_ahead=0.0, tolerance_N=0.1)
    assert report.outcome is Outcome.OUT_OF_TOLERANCE


def stuck():
    """Shows what is asked for from the first time on that it was felt."""
    pressed = False

    def spoil(sample):
        nonlocal pressed
        fx, fy, fz = sample.force_N
        pressed = pressed or fz < 6.0 - 4.8
        return replace(sample, force_N=(fx, fy, 6.0 - 4.9)) if pressed else sample

    return spoil


def halved(sample):
    fx, fy, fz = sample.force_N
    return replace(sample, force_N=(fx, fy, 6.0 + 0.5 * (fz - 6.0)))


@pytest.mark.parametrize(("spoil", "stiffness_N_per_mm"), [(stuck(), 0.0), (halved, 2.5)])
def test_a_faulty_sensor_is_named_before_a_stroke(spoil, stiffness_N_per_mm):
    world = FakeWorld()
    world.spoil = spoil
    report = followed(world)
    assert report.outcome is Outcome.CONTACT_MISMATCH
    measured = float(report.events[-1].detail.split("along the axis ")[1].split()[0])
    assert measured == pytest.approx(stiffness_N_per_mm, abs=0.8)


def test_a_surface_that_is_not_there_ends_the_trial():
    report = followed(FakeWorld(height_m=0.012))
    assert report.outcome is Outcome.NO_CONTACT
    assert followed(sloping(0.3), relief_mm=0.5).outcome is Outcome.CONTACT_MISMATCH


SHORT = f"--task {TASK} --task.options stroke_mm 10 way_mm 12"


def test_it_is_run_recorded_and_replayed_and_a_replay_without_the_package_is_refused(palpate, tmp_path, monkeypatch):
    out = tmp_path / "run"
    message = palpate.succeed("run", *SHORT.split(), "--arm", "ur5", "--trials", 1, "--out", out)
    assert message.startswith(f"{TASK}, ur5, scenario paper")
    assert "success 100.0%" in message
    # All options are recorded, those too that were not given.
    assert '"speed_mm_s" = 20.0' in (out / "run.toml").read_text()
    assert "1 of 1 equal" in palpate.succeed("replay", out, "--jobs", 1)
    what_if = palpate("replay", out, "--jobs", 1, "--set", "task.press_kgf=0.3")
    assert (what_if.code, "1 would have a different result" in what_if.stdout) == (1, True)
    assert "uses no policy" in palpate("replay", out, "--jobs", 1, "--policy", "torque").stdout
    sys.modules.pop("surface_follow", None)
    task_kind.cache_clear()
    monkeypatch.setattr(sys, "path", [place for place in sys.path if place != str(PACKAGE)])
    without = palpate("replay", out, "--jobs", 1)
    assert (without.code, "No module named 'surface_follow'" in without.stdout) == (2, True)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (f"run --task={TASK} --policy torque", f"left out with --task {TASK}"),
        (f"run {SHORT} --cell.contacts listed", "searched, with a contour"),
        (f"train {SHORT}", "a task that lets a policy choose"),
        (f"compare {SHORT}", "uses no policy"),
    ],
)
def test_what_does_not_go_with_it_is_one_line(palpate, words, message):
    palpate.refuses(words, message)
