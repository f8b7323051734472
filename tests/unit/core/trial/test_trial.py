"""Settings of a task, its frame, and the random streams of a trial."""

from itertools import product
from math import hypot, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.trial import ExplorationArea, GoalConfig, draw_in_disc, goal_in_base
from palpate.core.trial.config import TaskConfig
from palpate.core.trial.report import Purpose, generator


@pytest.mark.parametrize(
    ("field", "settings", "said"),
    [
        ("press_kgf", {"contact_kgf": 0.5, "press_kgf": 0.5}, "more than task.contact_kgf = 0.5"),
        ("max_force_N", {"press_kgf": 2.0, "max_force_N": 19.0}, "more than the pressing force, 19.6 N"),
        ("start_uncertainty_mm", {"start_uncertainty_mm": 3.0, "area_half_width_mm": 2.5}, "outside the exploration"),
    ],
)
def test_settings_that_contradict_each_other_are_refused(field, settings, said):
    with pytest.raises(ConfigurationError) as caught:
        TaskConfig(**settings)
    assert caught.value.field == f"task.{field}"
    assert said in str(caught.value)


SHAPES = ("disc", "ball")
coordinates = st.floats(-0.02, 0.02)


class TestFrame:
    def test_task_frame_stands_on_the_plate_and_looks_into_the_hole(self):
        goal = goal_in_base(GoalConfig(380.0, -50.0, 25.0))
        assert goal.translation.tolist() == pytest.approx([0.380, -0.050, 0.025])
        for in_task, in_base in (([1, 0, 0], [1, 0, 0]), ([0, 1, 0], [0, -1, 0]), ([0, 0, 1], [0, 0, -1])):
            assert (goal.rotation @ in_task).tolist() == in_base
        assert np.linalg.det(goal.rotation) == pytest.approx(1.0)

    @given(st.integers(0, 2**32), st.floats(0.0, 0.05), st.sampled_from(SHAPES))
    def test_offset_stays_within_its_radius(self, seed, radius, shape):
        x, y = draw_in_disc(np.random.default_rng(seed), radius, shape)
        assert hypot(x, y) <= radius * (1 + 1e-12)

    @pytest.mark.parametrize(
        ("shape", "mean_square", "numbers"),
        # Mean of (r / R)^2: 1/2 over a disc; 3/5 in a ball, of which two thirds are in the plane.
        [("disc", 0.5, 2), ("ball", 0.4, 3)],
    )
    def test_offsets_are_spread_evenly(self, shape, mean_square, numbers):
        rng, count = np.random.default_rng(11), 20_000
        points = np.array([draw_in_disc(rng, 3e-3, shape) for _ in range(count)])
        radius = np.hypot(*points.T) / 3e-3
        assert (radius**2).mean() == pytest.approx(mean_square, abs=0.01)
        assert radius.max() > 0.99
        sectors = np.histogram(np.arctan2(points[:, 1], points[:, 0]), bins=12, range=(-pi, pi))[0]
        assert ((sectors - count / 12) ** 2 / (count / 12)).sum() < 31.3  # chi squared, 11 degrees, 0.1 %
        # Exactly so many random numbers, or the streams of other purposes would shift.
        other = np.random.default_rng(11)
        other.random(count * numbers)
        assert rng.random() == other.random()

    @given(centre=st.tuples(coordinates, coordinates), point=st.tuples(coordinates, coordinates))
    def test_clamping_gives_the_nearest_point_of_the_area(self, centre, point):
        area = ExplorationArea(centre, 3.5e-3)
        clamped = area.clamp(*point)
        for value, c, requested in zip(clamped, centre, point, strict=True):
            assert abs(value - c) <= 3.5e-3 * (1 + 1e-12)
            if abs(requested - c) < 3.5e-3:
                assert value == requested
            elif requested != c:
                assert value == (c + 3.5e-3 if requested > c else c - 3.5e-3)
        assert area.clamp(*clamped) == clamped


purposes = st.sampled_from(Purpose)
seeds = st.integers(0, 2**63 - 1)
trials = st.integers(0, 100_000)


def numbers(seed, purpose, trial):
    return generator(seed, purpose, trial).integers(0, 2**63, 4).tolist()


class TestRandomness:
    @given(seeds, purposes, trials)
    def test_stream_is_the_same_whenever_it_is_asked_for(self, seed, purpose, trial):
        first = numbers(seed, purpose, trial)
        for other in Purpose:
            generator(seed, other, trial + 1).random(100)
        assert numbers(seed, purpose, trial) == first

    def test_no_two_streams_of_a_run_are_alike(self):
        streams = [tuple(numbers(s, p, t)) for s, p, t in product(range(3), Purpose, range(40))]
        assert len(set(streams)) == len(streams)

    def test_purposes_are_never_renumbered(self):
        # Logs depend on these values.
        names = "START HOLE SENSOR POLICY PARTITION FITTING RANDOM_WALKS HOLE_SHIFT GRIP ZERO HIDDEN PLATE DITHER LIMIT"
        assert [purpose.name for purpose in sorted(Purpose, key=lambda one: one.value)] == names.split()
        assert [purpose.value for purpose in Purpose] == [*range(14)]

    def test_streams_stay_what_they_were(self):
        # Another generator or another way of spawning would silently change every published result.
        golden = [9908662068004701370, 6836224713556591529]
        assert generator(7, Purpose.POLICY, 3).bit_generator.random_raw(2).tolist() == golden
