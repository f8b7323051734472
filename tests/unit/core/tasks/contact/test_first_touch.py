"""The stiffness of the first touch, on a spring that sensor and encoders read at times of their own."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.ports.values import JointSample, Snapshot, WrenchSample
from palpate.core.tasks.contact import HIGHEST_SHARE, LOWEST_SHARE, FirstTouch

STIFFNESS_N_PER_M = 5e3
PRESS_N = 4.9
TICK_NS = 7_142_857


def touch(
    *,
    scale: float = 1.0,
    noise_N: float = 0.0,
    joints_every: int = 1,
    joints_late_ns: int = 0,
    depth_m: float = 1e-3,
    held: bool = False,
    seed: int = 2,
) -> FirstTouch:
    """An approach that sinks into the spring within 40 ticks, after as many in free space.

    Args:
        joints_every: An encoder sample is new so often, in ticks.
        joints_late_ns: So long before it is read the encoders' sample was taken.
    """
    first = FirstTouch(STIFFNESS_N_PER_M, PRESS_N)
    rng = np.random.default_rng(seed)
    joints, depth_then = JointSample((0.0,), -1, -1, 0), 0.0

    def depth_at(time_ns: float) -> float:
        ticks = time_ns / TICK_NS - 40
        return depth_m * (1.0 - np.exp(-ticks / 12)) if ticks > 0 else ticks * depth_m / 12

    for tick in range(80):
        now_ns = tick * TICK_NS
        if tick % joints_every == 0:
            taken_ns = now_ns - joints_late_ns
            joints, depth_then = JointSample((0.0,), taken_ns, now_ns, tick), depth_at(taken_ns)
        force_N = -scale * STIFFNESS_N_PER_M * max(depth_at(now_ns), 0.0)
        if held and tick > 40:
            force_N = -0.5 * PRESS_N
        force_N += noise_N * rng.standard_normal()
        wrench = WrenchSample((0.0, 0.0, force_N), (0.0, 0.0, 0.0), now_ns, now_ns, tick)
        first.watch(Snapshot(tick, now_ns, wrench, joints), force_N, depth_then)
    return first


@given(st.floats(0.5, 10.0))
def test_the_share_is_what_the_sensor_is_scaled_by(scale: float) -> None:
    assert touch(scale=scale).share == pytest.approx(scale, rel=1e-6)


@pytest.mark.parametrize("noise_N", [0.1, 0.3])
def test_noise_moves_the_share_little(noise_N: float) -> None:
    share = touch(noise_N=noise_N).share
    assert share is not None
    assert LOWEST_SHARE < share < HIGHEST_SHARE


@pytest.mark.parametrize("late_ns", [0, 20_000_000])
@pytest.mark.parametrize("every", [2, 5])
def test_slow_and_late_encoders_are_aligned_by_the_samples_times(every: int, late_ns: int) -> None:
    assert touch(joints_every=every, joints_late_ns=late_ns).share == pytest.approx(1.0, abs=0.05)


def test_a_touch_too_light_to_tell_a_stiffness_gives_none() -> None:
    assert touch(depth_m=0.15e-3, scale=4.0).share is None


@pytest.mark.parametrize("noise_N", [0.0, 0.1])
def test_a_held_sensor_shows_no_stiffness(noise_N: float) -> None:
    share = touch(held=True, noise_N=noise_N).share
    assert share is None or share < LOWEST_SHARE
