"""The lift that shows whether the force follows the gripper's spring, on a spring of the test's own."""

from collections import deque
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.ports.values import PERIOD_S
from palpate.core.tasks.contact.axial_check import HIGHEST_SHARE, LOWEST_SHARE, AxialCheck

STIFFNESS_N_PER_M = 5e3
PRESS_N = 4.9
LONGEST_TICKS = 400


class Spring:
    """A tool pressed on a plate through a spring, by servos that lag, read by encoders that lag further.

    Attributes:
        check: The check, made on it.
        deepest_m, highest_m: How far down and up the tip was commanded.
        ticks: How long the check took.
        moved_m: How far from its place the tool is commanded to be in the end.
    """

    def __init__(
        self,
        *,
        lag_ticks: float = 0.0,
        encoders_late_ticks: int = 0,
        repeats: int = 1,
        noise_N: float = 0.0,
        sensor: Callable[[float], float] = lambda force_N: force_N,
        follows: float = 1.0,
        slips_at_tick: int | None = None,
    ) -> None:
        self.check = AxialCheck(STIFFNESS_N_PER_M, PRESS_N, 0.02, PERIOD_S)
        self._pressed_m = PRESS_N / STIFFNESS_N_PER_M
        rng = np.random.default_rng(11)
        z = arm = home = 0.01
        seen = deque([home] * (encoders_late_ticks + 1), maxlen=encoders_late_ticks + 1)
        surface = home - self._pressed_m
        force_N = 0.0
        self.deepest_m = self.highest_m = home
        for self.ticks in range(LONGEST_TICKS):
            arm += (home + follows * (z - home) - arm) / (1.0 + lag_ticks)
            seen.append(arm)
            if self.ticks == slips_at_tick:
                surface += 0.8 * self._pressed_m
            new = self.ticks % repeats == 0
            if new:
                force_N = sensor(-STIFFNESS_N_PER_M * max(arm - surface, 0.0)) + noise_N * rng.standard_normal()
            velocity = self.check.velocity_m_s(force_N, new, z, seen[0])
            if velocity is None:
                break
            z += velocity * PERIOD_S
            self.deepest_m, self.highest_m = max(self.deepest_m, z), min(self.highest_m, z)
        self.moved_m = z - home


def test_a_spring_as_stiff_as_the_grippers_passes_and_the_tool_is_back_in_place() -> None:
    spring = Spring()
    assert spring.check.passed
    assert spring.check.share == pytest.approx(1.0, abs=1e-6)
    assert spring.moved_m == pytest.approx(0.0, abs=1e-8)
    assert spring.ticks < 60


def test_the_lift_keeps_contact_and_never_presses_harder() -> None:
    spring = Spring()
    lift_m = 0.01 - spring.highest_m
    assert lift_m == pytest.approx(0.4 * PRESS_N / STIFFNESS_N_PER_M)
    assert spring.deepest_m == 0.01


@pytest.mark.parametrize("lag_ticks", [1.0, 3.0])
def test_servos_that_lag_make_no_difference(lag_ticks: float) -> None:
    assert Spring(lag_ticks=lag_ticks).check.share == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("noise_N", [0.1, 0.3])
def test_noise_of_a_force_sensor_is_averaged_away(noise_N: float) -> None:
    assert Spring(noise_N=noise_N).check.passed


@pytest.mark.parametrize(
    "sensor",
    [
        pytest.param(lambda force_N: -PRESS_N, id="held"),
        pytest.param(lambda force_N: 0.5 * force_N - 0.5 * PRESS_N, id="half the change"),
        pytest.param(lambda force_N: -force_N - 2 * PRESS_N, id="flipped"),
        pytest.param(lambda force_N: 2 * force_N + PRESS_N, id="twice the change"),
    ],
)
@pytest.mark.parametrize("noise_N", [0.0, 0.1])
def test_a_sensor_that_does_not_follow_the_spring_fails(sensor: Callable[[float], float], noise_N: float) -> None:
    check = Spring(sensor=sensor, noise_N=noise_N).check
    assert check.share is not None
    assert not check.passed


@given(st.floats(0.5, 2.0))
def test_the_share_is_what_the_sensor_is_scaled_by(scale: float) -> None:
    # The offset keeps the force before the lift: a sensor that starts to lie while the tool is pressed.
    check = Spring(sensor=lambda force_N: scale * (force_N + PRESS_N) - PRESS_N).check
    assert check.share == pytest.approx(scale, rel=1e-6)
    # At the very ends the last bits of the share decide.
    assert scale in (LOWEST_SHARE, HIGHEST_SHARE) or check.passed == (LOWEST_SHARE < scale < HIGHEST_SHARE)


@pytest.mark.parametrize("noise_N", [0.0, 0.1])
def test_an_arm_that_does_not_follow_fails(noise_N: float) -> None:
    spring = Spring(follows=0.0, noise_N=noise_N)
    assert spring.check.share is not None
    assert spring.check.share < LOWEST_SHARE
