"""A contour of springs is followed with an even force; what lies about it is named."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from palpate.core.control_loop import run_trial
from palpate.core.ports import WrenchSample
from palpate.core.tasks.surface_follow import SURFACE_FOLLOW, FollowTask
from palpate.core.trial import ControlConfig, Outcome, TaskConfig, TrialReport
from tests.unit.core.fake_world import FakeWorld, measurement, tip_motion

WAY: dict[str, float] = {"stroke_mm": 6.0, "way_mm": 9.0}


def followed(world: FakeWorld, **options: float) -> TrialReport:
    task = TaskConfig(name="surface-follow", options=WAY | options)
    follow = FollowTask(task, ControlConfig(damping_N_s_per_m=100.0), measurement(), tip_motion())
    with world:
        return run_trial(follow, world.ports, SURFACE_FOLLOW.setup(task, 1, 0))


def sloping(slope: float) -> FakeWorld:
    world = FakeWorld()
    world.slope = slope
    return world


@pytest.mark.parametrize("slope", [0.0, 0.1, -0.1])
def test_a_slope_is_led_ahead_of_the_force(slope: float) -> None:
    led, yielding = (followed(sloping(slope), lead_ahead=lead) for lead in (1.0, 0.0))
    assert (led.outcome, yielding.outcome) == (Outcome.DONE, Outcome.DONE)
    rms_N = [float(report.events[-1].detail.split(" m, ")[1].split()[0]) for report in (led, yielding)]
    # Without the lead the damping law needs an error to move at all: 100 N s/m times 2 mm/s.
    assert rms_N[0] < 0.1
    assert rms_N[1] == pytest.approx(abs(slope) * 0.02 * 100.0, abs=0.05)
    assert [event.name for event in led.events].count("proof") >= 2


def test_an_error_above_the_tolerance_is_no_success() -> None:
    report = followed(sloping(0.1), lead_ahead=0.0, tolerance_N=0.1)
    assert report.outcome is Outcome.OUT_OF_TOLERANCE


def stuck() -> Callable[[WrenchSample], WrenchSample]:
    """Shows what is asked for from the first time on that it was felt."""
    pressed = False

    def spoil(sample: WrenchSample) -> WrenchSample:
        nonlocal pressed
        fx, fy, fz = sample.force_N
        pressed = pressed or fz < 6.0 - 4.8
        return replace(sample, force_N=(fx, fy, 6.0 - 4.9)) if pressed else sample

    return spoil


def halved(sample: WrenchSample) -> WrenchSample:
    fx, fy, fz = sample.force_N
    return replace(sample, force_N=(fx, fy, 6.0 + 0.5 * (fz - 6.0)))


@pytest.mark.parametrize(("spoil", "told"), [(stuck(), "a lift with 0.0"), (halved, "a lift with 0.5")])
def test_a_sensor_that_lies_is_named_by_the_lift_before_a_stroke(
    spoil: Callable[[WrenchSample], WrenchSample], told: str
) -> None:
    world = FakeWorld()
    world.spoil = spoil
    report = followed(world)
    assert report.outcome is Outcome.UNPROVED
    assert told in report.events[-1].detail


def test_a_surface_that_is_not_there_ends_the_trial() -> None:
    report = followed(FakeWorld(height_m=0.012))
    assert report.outcome is Outcome.NO_CONTACT
    assert followed(sloping(0.3), relief_mm=0.5).outcome is Outcome.UNPROVED
