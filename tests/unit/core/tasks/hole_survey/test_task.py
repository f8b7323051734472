"""Holes in a plate of springs are found by touch, with what their numbers are worth; what lies about them is named."""

import random
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from math import hypot
from typing import Any

import pytest

from palpate.core.control_loop import run_trial
from palpate.core.errors import ConfigurationError
from palpate.core.ports import Truth, WrenchSample
from palpate.core.tasks.hole_survey import HOLE_SURVEY, SurveyTask, surveyed
from palpate.core.trial import N_PER_KGF, ControlConfig, Fit, Outcome, TaskConfig, TrialReport
from tests.unit.core.fake_world import (
    WEIGHT_AND_BIAS_N,
    WEIGHT_AND_BIAS_NM,
    FakeWorld,
    Pit,
    measurement,
    tip_motion,
)

QUICK: dict[str, float] = {
    "plate_touches": 2.0,
    "floor_touches": 2.0,
    "wall_touches": 6.0,
    "aside_mm": 5.0,
    "widest_mm": 9.0,
    "pitch_mm": 0.8,
}
TASK = TaskConfig(
    name="hole-survey",
    options=QUICK,
    more_goals_mm=(8.0, 4.0),
    ready_height_mm=1.5,
    area_half_width_mm=9.0,
    time_limit_s=60.0,
)
PLAY_M = 0.6e-3
HOLES = (Pit(0.3e-3, -0.2e-3, 0.004, PLAY_M, play_m=PLAY_M), Pit(9.1e-3, 4.4e-3, 0.006, PLAY_M, play_m=PLAY_M))
TRUTH = Truth((0.3e-3, -0.2e-3, 0.1e-3), (0.0, 0.0, 0.0), 0.0, 9.0, {"hole_2_x_mm": 9.1, "hole_2_y_mm": 4.4})
FIT = Fit(6.0, 0.6, 0.0, 4.0)


def survey(world: FakeWorld, task: TaskConfig = TASK) -> TrialReport:
    made = SurveyTask(task, ControlConfig(), measurement(), tip_motion())
    with world:
        return run_trial(made, world.ports, HOLE_SURVEY.setup(task, 1, 0))


def plate(*holes: Pit) -> FakeWorld:
    world = FakeWorld(*holes, height_m=0.1e-3)
    world.mass_kg = 0.3
    return world


def test_places_sizes_and_depths_of_holes_are_found_by_touch() -> None:
    report = survey(plate(*HOLES))
    assert report.outcome is Outcome.DONE
    # The second lies farther off its place than it is wider than the probe: it is looked for.
    for hole, true in zip(surveyed(report), HOLES, strict=True):
        found = [hole.x.mm, hole.y.mm, hole.diameter.mm, hole.depth.mm, hole.surface.mm]
        assert found == pytest.approx([true.x_m * 1e3, true.y_m * 1e3, 7.2, true.depth_m * 1e3, 0.1], abs=5e-3)
    # The truth here has the first one's depth for both.
    assert not HOLE_SURVEY.achieved(TASK, report, TRUTH, FIT)
    assert HOLE_SURVEY.untrue(TASK, report, TRUTH, FIT)
    alike = replace(TASK, more_goals_mm=())
    first = survey(plate(*HOLES[:1]), alike)
    assert HOLE_SURVEY.achieved(alike, first, TRUTH, FIT)
    assert not HOLE_SURVEY.untrue(alike, first, TRUTH, FIT)


def test_a_hole_that_is_not_there_is_said_so() -> None:
    report = survey(plate(HOLES[0]), replace(TASK, options=QUICK | {"search_mm": 1.0}))
    assert report.outcome is Outcome.OUT_OF_TOLERANCE
    assert HOLE_SURVEY.untrue(TASK, report, TRUTH, FIT)
    assert [event.detail for event in report.events if event.name == "measured"][
        1
    ] == "hole 2: not found within 1 mm of its place"


@pytest.mark.parametrize(("sooner_mm", "outcome"), [(0.1, Outcome.OUT_OF_TOLERANCE), (0.5, Outcome.UNPROVED)])
def test_what_bears_the_probe_at_a_holes_edge_has_to_do_so_twice(sooner_mm: float, outcome: Outcome) -> None:
    """A force that came ever later led to "no floor" at a touch on the plate, and the next would have been in air."""
    shallow = Pit(HOLES[0].x_m, HOLES[0].y_m, 0.8e-3, PLAY_M, play_m=PLAY_M)
    world = plate(shallow)
    reads = count()

    def moved(sample: WrenchSample) -> WrenchSample:
        if next(reads) == 600:
            world.height_m -= 1e-3 * sooner_mm
        return sample

    world.spoil = moved
    report = survey(world, replace(TASK, more_goals_mm=()))
    assert report.outcome is outcome


def scaled(share: float, *axes: int) -> Callable[[WrenchSample], WrenchSample]:
    """Forces along these axes, and the torques that go with them."""

    def spoil(sample: WrenchSample) -> WrenchSample:
        zero = (*WEIGHT_AND_BIAS_N, *WEIGHT_AND_BIAS_NM)
        wrench = [*sample.force_N, *sample.torque_Nm]
        for axis in (*axes, *(4 - axis for axis in axes if axis < 2)):
            wrench[axis] = zero[axis] + share * (wrench[axis] - zero[axis])
        x, y, z, tx, ty, tz = wrench
        return replace(sample, force_N=(x, y, z), torque_Nm=(tx, ty, tz))

    return spoil


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (scaled(0.5, 0, 1), "control.lateral_stiffness_N_per_mm"),
        (scaled(0.0, 0, 1), "no wall of the hole answers"),
        (scaled(1.6, 2), "a lift with 1.6"),
        (scaled(0.0, 2), "nothing bears the pressing force down to 1.50 mm"),
    ],
)
def test_a_sensor_that_lies_is_named_at_a_touch(spoil: Callable[[WrenchSample], WrenchSample], told: str) -> None:
    world = plate(*HOLES)
    world.spoil = spoil
    report = survey(world, TASK)
    assert report.outcome is Outcome.UNPROVED
    assert told in report.events[-1].detail


@pytest.mark.parametrize("every", [7, 19, 31])
def test_a_single_noisy_sample_off_a_wall_is_no_lie(every: int) -> None:
    world, reads = plate(HOLES[0]), count()

    def spiked(sample: WrenchSample) -> WrenchSample:
        x, y, z = sample.force_N
        return replace(sample, force_N=(x + (0.0 if next(reads) % every else 1.5), y, z))

    world.spoil = spiked
    assert survey(world, replace(TASK, more_goals_mm=())).outcome is Outcome.DONE


def test_a_force_that_comes_late_takes_the_probe_further_off_the_wall_before_it_is_met_slowly() -> None:
    world, past = plate(HOLES[0]), deque[WrenchSample](maxlen=5)

    def late(sample: WrenchSample) -> WrenchSample:
        past.append(sample)
        return replace(past[0], sequence=sample.sequence)

    world.spoil = late
    assert survey(world, replace(TASK, more_goals_mm=())).outcome is Outcome.DONE


@pytest.mark.parametrize("settings", [{"press_kgf": 0.9}, {"options": QUICK | {"push_N": 14.0}}])
def test_what_the_gripper_gives_is_no_depth_and_no_width(settings: dict[str, Any]) -> None:
    """More than 1.5 mm along the axis, and 0.3 mm across it."""
    assert survey(plate(HOLES[0]), replace(TASK, more_goals_mm=(), **settings)).outcome is Outcome.DONE


@pytest.mark.parametrize("last", [480, 570, 588, 810, 1290])
def test_a_sensor_that_dies_with_noise_is_found_before_it_lets_the_tool_press_hard(last: int) -> None:
    world, chance, peaks_N, alive = plate(HOLES[0]), random.Random(1), [0.0], list[WrenchSample]()

    def die(sample: WrenchSample) -> WrenchSample:
        peaks_N.append(hypot(*world.force_N))
        if len(peaks_N) < last:
            alive[:] = [sample]
        x, y, z = (force + chance.gauss(0.0, 0.1) for force in alive[0].force_N)
        return replace(sample, force_N=(x, y, z), torque_Nm=alive[0].torque_Nm)

    world.spoil = die
    assert survey(world, replace(TASK, more_goals_mm=())).outcome is Outcome.UNPROVED
    assert max(peaks_N) < 30.0


def test_a_force_that_bears_the_probe_and_becomes_no_more_lets_it_give_way_for_no_longer_than_a_second() -> None:
    world, reads, across_m = plate(HOLES[0]), count(), [0.0]

    def stay(sample: WrenchSample) -> WrenchSample:
        if next(reads) < 560:
            return sample
        across_m.append(hypot(world.tip_m[0], world.tip_m[1]))
        x, y, z = WEIGHT_AND_BIAS_N
        return replace(sample, force_N=(x + 0.6, y, z - 0.7 * TASK.press_kgf * N_PER_KGF))

    world.spoil = stay
    report = survey(world, replace(TASK, more_goals_mm=()))
    assert report.outcome is Outcome.UNPROVED
    assert "bear the tool and become no more" in report.events[-1].detail
    assert max(across_m) - across_m[1] < 0.3e-3


@pytest.mark.parametrize(("last", "share"), [(540, 0.3), (600, 1.0), (600, 0.3)])
def test_a_recording_of_its_own_heave_does_not_let_the_tool_press_hard(last: int, share: float) -> None:
    world, chance, peaks_N, felt = plate(HOLES[0]), random.Random(1), [0.0], list[WrenchSample]()

    def repeat(sample: WrenchSample) -> WrenchSample:
        peaks_N.append(hypot(*world.force_N))
        felt.append(sample if len(felt) < last else felt[-140])
        return sample if len(felt) <= last else noisy(felt[-1])

    def noisy(sample: WrenchSample) -> WrenchSample:
        forces = zip(WEIGHT_AND_BIAS_N, sample.force_N, strict=True)
        x, y, z = (zero_N + share * (force_N - zero_N) + chance.gauss(0.0, 0.1) for zero_N, force_N in forces)
        return replace(sample, force_N=(x, y, z))

    world.spoil = repeat
    assert survey(world, replace(TASK, more_goals_mm=())).outcome is Outcome.UNPROVED
    assert max(peaks_N) < 35.0


@pytest.mark.parametrize(
    ("options", "task", "told"),
    [
        ({"wall_touches": 7.5}, {}, "a whole number"),
        ({"widest_mm": 5.0}, {}, "more than probe_mm = 6"),
        ({"push_N": 25.0}, {"max_force_N": 20.0}, "less than task.max_force_N = 20"),
        ({"push_N": 1.0}, {}, "too few samples"),
        ({"tool_kg": 0.0}, {}, "0 with tool_kg = 0"),
        ({}, {"more_goals_mm": (1.0,)}, "x and y of each further place"),
        ({}, {"more_goals_mm": (900.0, 0.0)}, "a place that zebra-zero reaches"),
    ],
)
def test_what_cannot_be_is_refused(options: dict[str, float], task: dict[str, object], told: str) -> None:
    def refused_task() -> None:
        made = replace(TASK, options=QUICK | options, **task)  # type: ignore[arg-type]
        HOLE_SURVEY.ready("zebra-zero", made)
        survey(plate(), made)

    with pytest.raises(ConfigurationError) as refused:
        refused_task()
    assert told in str(refused.value)
