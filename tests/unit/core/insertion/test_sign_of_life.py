"""Signs of life of a force sensor while the tool slides: force and torque that change together."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.insertion.sign_of_life import FREE_WAY_M, SignOfLife
from palpate.core.motion.model import Array
from palpate.core.ports.values import WrenchSample

LEVER_M = 0.14
STEP_M = 2e-5
"""Commanded way of the tool in a tick."""
Sensor = Callable[[Array], Array]


def sample(wrench: Array, sequence: int) -> WrenchSample:
    a, b, c, d, e, f = wrench.tolist()
    return WrenchSample((a, b, c), (d, e, f), sequence, sequence, sequence)


class Slide:
    """A tool that rests in free space and then sticks and slips over a plate.

    Attributes:
        life: What was made of it.
        longest_m: The longest way without a sign of life.
    """

    def __init__(
        self,
        sensor: Sensor = lambda wrench: wrench,
        *,
        noise_N: float = 0.0,
        lever_m: float = LEVER_M,
        repeats: int = 1,
        rests: bool = True,
    ) -> None:
        self.life = SignOfLife(lever_m)
        self.longest_m = 0.0
        rng = np.random.default_rng(7)
        noise = noise_N * np.array([1.0, 1.0, 1.0, 0.04, 0.04, 0.04])
        for sequence in range(28 if rests else 0):
            self.life.rest(sample(noise * rng.standard_normal(6), sequence))
        self.life.resume()
        across, load = np.zeros(2), np.array([0.3, 0.1])
        for tick in range(400):
            # Static friction loads the gripper until the tool slips.
            across = across + load if tick % 9 else across * 0.2
            fx, fy = across.tolist()
            true = np.array([fx, fy, -4.9, -lever_m * fy, lever_m * fx, 0.0])
            if tick % repeats == 0:
                shown = sample(sensor(true) + noise * rng.standard_normal(6), 100 + tick)
            self.life.watch(shown, (STEP_M * tick, 0.0, 0.0))
            self.longest_m = max(self.longest_m, self.life.travel_m)


def test_stick_and_slip_is_a_sign_of_life() -> None:
    slide = Slide()
    assert not slide.life.due
    assert slide.longest_m < 0.5 * FREE_WAY_M


@pytest.mark.parametrize("noise_N", [0.1, 0.3])
def test_noise_does_not_hide_it(noise_N: float) -> None:
    assert Slide(noise_N=noise_N).longest_m < FREE_WAY_M


@pytest.mark.parametrize("lever_m", [0.05, -0.14])
def test_the_side_and_length_of_the_lever_make_no_difference(lever_m: float) -> None:
    assert not Slide(lever_m=lever_m).life.due


def test_repeated_samples_are_no_changes() -> None:
    assert not Slide(repeats=3).life.due


@given(st.floats(0.5, 100.0))
def test_the_scale_of_all_channels_makes_no_difference(scale: float) -> None:
    assert Slide(lambda wrench: scale * wrench).longest_m == Slide().longest_m


def zeroed(*channels: int) -> Sensor:
    return lambda wrench: np.where(np.isin(np.arange(6), channels), 0.0, wrench)


@pytest.mark.parametrize("noise_N", [0.0, 0.1, 0.3])
@pytest.mark.parametrize(
    "sensor",
    [
        pytest.param(lambda wrench: 0.0 * wrench, id="dead"),
        pytest.param(zeroed(0, 1), id="lateral forces dead"),
        pytest.param(zeroed(3, 4), id="torques dead"),
        pytest.param(lambda wrench: wrench * (1, 1, 1, -1, -1, 1), id="torques flipped"),
    ],
)
def test_a_sensor_that_does_not_show_what_there_is_gives_none(sensor: Sensor, noise_N: float) -> None:
    assert Slide(sensor, noise_N=noise_N).longest_m == pytest.approx(399 * STEP_M)


@pytest.mark.parametrize("noise_N", [0.1, 0.3])
def test_a_sensor_scaled_down_into_its_noise_gives_none(noise_N: float) -> None:
    assert Slide(lambda wrench: 0.01 * wrench, noise_N=noise_N).life.due


@pytest.mark.parametrize("noise_N", [0.1, 0.3])
def test_a_sensor_of_unknown_noise_is_judged_by_correlation_alone(noise_N: float) -> None:
    assert Slide(lambda wrench: 0.0 * wrench, noise_N=noise_N, rests=False).life.due


@pytest.mark.parametrize("noise_N", [0.0, 0.1])
def test_what_the_touch_changed_is_no_sign_of_life(noise_N: float) -> None:
    """A sensor held since the touch: its only change lies before the slide."""
    touched = np.array([1.5, 1.5, -4.9, -LEVER_M * 1.5, LEVER_M * 1.5, 0.0])
    slide = Slide(lambda wrench: touched, noise_N=noise_N)
    assert slide.longest_m == pytest.approx(399 * STEP_M)


def test_an_answer_to_a_check_and_a_demand_for_one() -> None:
    slide = Slide(lambda wrench: 0.0 * wrench)
    slide.life.proved()
    assert slide.life.travel_m == 0.0
    slide.life.demand_check()
    assert slide.life.due
