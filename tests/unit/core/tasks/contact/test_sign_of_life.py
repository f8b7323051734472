"""Signs of life of a force sensor while the tool slides: an axial force that follows the heave, or does not."""

from collections.abc import Callable
from itertools import accumulate

import numpy as np
import pytest

from palpate.core.ports import CONTROL_RATE_HZ
from palpate.core.tasks.contact.sign_of_life import FREE_WAY_M, SignOfLife

STIFFNESS_N_PER_M = 5e3
PRESS_N, SWING_N = 4.9, 1.2
DAMPING_N_S_PER_M = 400.0
SPEED_M_S = 0.02
STEP_M = 4e-5
"""Commanded way of the tool in a tick."""
Sensor = Callable[[float], float]


class Slide:
    """A tool that slides over a plate, pressing by what its sensor shows; one check at most finds the sensor sound.

    Attributes:
        due_ticks: When checks were due.
        longest_m: The longest way without a sign of life.
    """

    def __init__(
        self,
        sensor: Sensor = lambda force: force,
        *,
        noise_N: float = 0.0,
        late_ticks: int = 0,
        servo: float = 0.0,
        repeats: int = 1,
        dies: int = 0,
        step_m: float = STEP_M,
        checked: bool = False,
        repeated_ticks: int = 0,
        uneven: bool = False,
        seed: int = 7,
    ) -> None:
        life = SignOfLife(STIFFNESS_N_PER_M, SWING_N, SPEED_M_S, uneven=uneven)
        life.begin(np.random.default_rng(seed))
        rng = np.random.default_rng(seed)
        recorded: list[float] = []
        self.due_ticks: list[int] = []
        self.longest_m = shown = 0.0
        commanded = [PRESS_N / STIFFNESS_N_PER_M]
        follows = commanded[0]
        forces = [-PRESS_N] * (late_ticks + 1)
        if checked:
            life.demand_check()
        for tick in range(400):
            follows += (1.0 - servo) * (commanded[-1] - follows)
            forces.append(-STIFFNESS_N_PER_M * follows)
            if tick % repeats == 0:
                true = forces[-1 - late_ticks]
                recorded.append(recorded[-repeated_ticks] if repeated_ticks and tick >= dies else true)
                shown = (sensor(recorded[-1]) if tick >= dies else true) + noise_N * rng.standard_normal()
            life.watch(shown, tick % repeats == 0, (step_m * tick, 0.0, commanded[-1]))
            self.longest_m = max(self.longest_m, life.travel_m)
            if life.due:
                self.due_ticks.append(tick)
                life.proved()
            speed_m_s = (shown + PRESS_N) / DAMPING_N_S_PER_M + life.heave_m_s()
            commanded.append(commanded[-1] + speed_m_s / CONTROL_RATE_HZ)


@pytest.mark.parametrize("noise_N", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("setup", [{"late_ticks": 0}, {"late_ticks": 3}, {"late_ticks": 6}, {"servo": 0.3}])
def test_a_force_that_follows_is_a_sign_of_life(setup: dict[str, float], noise_N: float) -> None:
    slide = Slide(noise_N=noise_N, **setup)  # type: ignore[arg-type]
    assert slide.due_ticks == []
    assert slide.longest_m < 0.8 * FREE_WAY_M


@pytest.mark.parametrize("noise_N", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("setup", [{"late_ticks": 0}, {"late_ticks": 3}, {"late_ticks": 6}, {"servo": 0.3}])
def test_a_force_that_follows_uneven_strokes_is_one_too(setup: dict[str, float], noise_N: float) -> None:
    slides = [Slide(noise_N=noise_N, uneven=True, seed=seed, **setup) for seed in range(8)]  # type: ignore[arg-type]
    assert sum(len(slide.due_ticks) for slide in slides) <= 1


@pytest.mark.parametrize("repeated_ticks", [14, 140])
def test_what_was_recorded_in_an_uneven_heave_does_not_follow_the_next(repeated_ticks: int) -> None:
    """Of an even heave of ten ticks a second holds fourteen: its recording follows for ever, in all of these."""
    after: list[int] = []
    for seed in range(20):
        dies = 150 + seed % 10
        slide = Slide(noise_N=0.1, dies=dies, repeated_ticks=repeated_ticks, uneven=True, seed=seed)
        after.append(next(tick - dies for tick in slide.due_ticks if tick > dies))
    assert np.median(after) < 40
    assert max(after) < 150


@pytest.mark.parametrize(
    ("repeated_ticks", "seed"),
    [(14, 112), (21, 2), (21, 21), (21, 97), (70, 60), (70, 70), (70, 73), (70, 89), (70, 120)],
)
def test_a_recording_that_happens_to_fit_an_uneven_heave_is_found_as_it_comes_again(
    repeated_ticks: int, seed: int
) -> None:
    """By the spring alone it was believed for 64 to 99 ticks in these, of 150 seeds each."""
    dies = 150 + seed % 10
    slide = Slide(noise_N=0.1, dies=dies, repeated_ticks=repeated_ticks, uneven=True, seed=seed)
    assert next(tick for tick in slide.due_ticks if tick > dies) < dies + 50


def test_a_check_of_a_sound_sensor_is_not_followed_by_another() -> None:
    """A tool at 19 mm/s goes the free way in fewer ticks than are needed to judge it without what was before."""
    slide = Slide(step_m=0.019 / CONTROL_RATE_HZ, checked=True)
    assert len(slide.due_ticks) <= 2


_WRONG: dict[str, Sensor] = {
    "held": lambda force: -PRESS_N,
    "dead": lambda force: 0.0,
    "0.01": lambda force: 0.01 * force,
    "0.1": lambda force: 0.1 * force,
}


@pytest.mark.parametrize("noise_N", [0.0, 0.006, 0.1, 0.3])
@pytest.mark.parametrize("dies", [0, 103])
@pytest.mark.parametrize("name", _WRONG)
def test_a_force_that_does_not_follow_demands_a_check_soon(name: str, dies: int, noise_N: float) -> None:
    slide = Slide(_WRONG[name], noise_N=noise_N, dies=dies)
    assert dies < slide.due_ticks[0] < dies + 30


@pytest.mark.parametrize("scale", [-1.0, 0.5, 2.0, 10.0])
@pytest.mark.parametrize("noise_N", [0.006, 0.1])
def test_other_scales_get_no_farther_than_the_free_way(scale: float, noise_N: float) -> None:
    slide = Slide(lambda force: scale * force, noise_N=noise_N)
    assert STEP_M * slide.due_ticks[0] < FREE_WAY_M + 2 * STEP_M


@pytest.mark.parametrize("late", [{"servo": 0.9}, {"servo": 0.95}])
def test_where_all_comes_late_only_the_way_demands_checks_after_the_first(late: dict[str, float]) -> None:
    slide = Slide(**late)  # type: ignore[arg-type]
    assert slide.due_ticks[0] < FREE_WAY_M / STEP_M
    apart = np.diff(slide.due_ticks)
    assert len(apart) > 3
    assert (apart * STEP_M >= FREE_WAY_M).all()


def test_repeated_samples_are_seen_once() -> None:
    """Half as many samples take twice as long to show the same; none show nothing, whatever the force is."""
    assert Slide(repeats=2).longest_m < FREE_WAY_M
    slide = Slide(repeats=400)
    assert np.diff([0, *slide.due_ticks]).min() * STEP_M >= FREE_WAY_M


@pytest.mark.parametrize("stiffness_N_per_m", [1e2, 5e3, 1e8])
@pytest.mark.parametrize("speed_m_s", [1e-3, 2e-2])
def test_a_heave_is_bounded_in_way_force_and_speed(stiffness_N_per_m: float, speed_m_s: float) -> None:
    life = SignOfLife(stiffness_N_per_m, SWING_N, speed_m_s)
    life.begin()
    speeds = [life.heave_m_s() for _ in range(200)]
    ways = list(accumulate(speed / CONTROL_RATE_HZ for speed in speeds))
    assert max(map(abs, speeds)) <= speed_m_s
    assert 0.0 < max(map(abs, ways)) <= 1.3 * min(2.5e-4, SWING_N / stiffness_N_per_m)
    assert ways[-1] == pytest.approx(0.0, abs=1e-12)


def test_a_demanded_check_is_due_until_it_is_proved() -> None:
    life = SignOfLife(STIFFNESS_N_PER_M, SWING_N, SPEED_M_S)
    life.begin()
    life.demand_check()
    assert life.due
    life.proved()
    assert not life.due
