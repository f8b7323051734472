"""Angles that follow their set-points later than before, or another way, are told; steady and honest ones are not."""

from collections.abc import Callable
from math import sin

import numpy as np
import pytest

from palpate.adapters.hardware.following import LATER_NS, Following

MS = 1_000_000
PERIOD_NS = 14 * MS


def wander(time_ns: int) -> np.ndarray:
    """A tool that searches: joints that go to and fro by some milliradians."""
    s = time_ns * 1e-9
    return np.array([2e-3 * sin(5.0 * s) + 1e-3 * sin(13.0 * s + 1.0), 1.5e-3 * sin(7.0 * s), 0.1])


def followed(
    angles: Callable[[int], np.ndarray],
    *,
    path: Callable[[int], np.ndarray] = wander,
    late_ns: Callable[[int], int] = lambda cycle: 0,
    noise_rad: float = 0.05e-3,
    seconds: float = 6.0,
) -> list[tuple[float, str]]:
    """What is told, and when, of angles that a bus finds."""
    rng, following, told = np.random.default_rng(3), Following(LATER_NS), []
    for cycle in range(round(seconds * 1e9 / PERIOD_NS)):
        now_ns = cycle * PERIOD_NS + late_ns(cycle)
        found = angles(now_ns) + rng.normal(0.0, noise_rad, 3)
        problem = following.note(now_ns, tuple(path(now_ns)), now_ns, tuple(found))
        if problem is not None:
            told.append((now_ns * 1e-9, problem))
    return told


def delayed(lag_ms: Callable[[int], float], path: Callable[[int], np.ndarray] = wander) -> Callable[[int], np.ndarray]:
    return lambda time_ns: path(time_ns - round(lag_ms(time_ns) * MS))


def test_angles_of_before_under_new_times_are_told_within_a_second() -> None:
    told = followed(delayed(lambda time_ns: 35.0 if time_ns < 3e9 else 95.0))
    assert told[0][1].startswith(("its angles follow the set-points 90 ms", "its angles follow the set-points 100 ms"))
    assert 3.2 < told[0][0] < 4.0


@pytest.mark.parametrize("share", [0.5, 1.7, -1.0])
def test_a_joint_that_moves_another_way_is_told_within_a_second(share: float) -> None:
    at, way = wander(3_000_000_000), np.array([1.0, share, 1.0])
    told = followed(lambda t: wander(t) if t < 3e9 else at + way * (wander(t) - at))
    assert told[0][1].startswith("joint 2 moves ")
    assert float(told[0][1].split()[3]) == pytest.approx(share, abs=0.1)
    assert 3.2 < told[0][0] < 4.0


@pytest.mark.parametrize(
    ("angles", "more"),
    [
        (delayed(lambda t: 60.0), {}),
        (delayed(lambda t: 30.0 if t < 3e9 else 55.0), {}),
        (delayed(lambda t: 30.0 + 15.0 * sin(t * 3e-9)), {}),
        # The load of a contact bends it: all that is late is the set-point's own motion.
        (lambda t: wander(t) + (0.0 if t < 3e9 else 2e-3), {}),
        (delayed(lambda t: 30.0), {"late_ns": lambda cycle: cycle * 7919 % 12 * MS}),
        # This computer was away, and again.
        (delayed(lambda t: 30.0), {"late_ns": lambda cycle: 200 * MS * (cycle // 40)}),
    ],
)
def test_an_honest_arm_is_not_told(angles: Callable[[int], np.ndarray], more: dict[str, object]) -> None:
    assert followed(angles, **more) == []  # type: ignore[arg-type]


def test_times_that_leap_tell_nothing() -> None:
    following = Following(LATER_NS)
    for cycle in range(300):
        now_ns = cycle * PERIOD_NS
        found_ns = now_ns + (10**12 if cycle > 100 else 0)
        assert following.note(now_ns, tuple(wander(now_ns)), found_ns, tuple(wander(now_ns))) is None


@pytest.mark.parametrize("speed_rad_s", [0.0, 0.1])
def test_a_steady_motion_has_no_delay(speed_rad_s: float) -> None:
    def path(time_ns: int) -> np.ndarray:
        return np.full(3, speed_rad_s * time_ns * 1e-9)

    assert followed(delayed(lambda t: 30.0 if t < 3e9 else 95.0, path), path=path) == []
