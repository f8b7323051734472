"""A force that comes again is found at any distance; one that rests, or answers strokes that are drawn, is not."""

import numpy as np
import pytest

from palpate.core.ports import CONTROL_RATE_HZ
from palpate.core.tasks.contact.answered import Recurrence

NOISE_N = 0.1
SWING_N = 0.4
"""Of what a stroke shows: twice of it is a sixteenth of what a touch would show."""


def strokes(samples: int, rng: np.random.Generator) -> np.ndarray:
    """What a tool in air shows that heaves by strokes of two to four ticks."""
    signs = np.concatenate([np.full(rng.integers(2, 5), (-1.0) ** i) for i in range(samples)])[:samples]
    return SWING_N * signs


def seen(forces_N: np.ndarray) -> list[bool]:
    """By sample, whether the force seemed to come again."""
    recurrence, found = Recurrence(), list[bool]()
    recurrence.begin_trial()
    for force_N in forces_N:
        recurrence.felt(float(force_N))
        found.append(recurrence.comes_again(NOISE_N))
    return found


@pytest.mark.parametrize("share", [1.0, -1.0, 2.0])
@pytest.mark.parametrize("length", [5, 14, 99, CONTROL_RATE_HZ, 210])
def test_a_recording_with_fresh_noise_is_found_once_it_has_come_again(length: int, share: float) -> None:
    rng = np.random.default_rng(length)
    honest_N = strokes(300, rng) + rng.normal(0.0, NOISE_N, 300)
    played_N = share * np.resize(honest_N[-length:], 500)
    found = seen(np.concatenate([honest_N, played_N + rng.normal(0.0, NOISE_N, 500)]))
    assert not any(found[:300])
    assert all(found[300 + length + 100 :])


@pytest.mark.parametrize("seed", range(3))
def test_strokes_that_are_drawn_and_rest_do_not_come_again(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rest_N = np.full(300, -4.9)
    forces_N = np.concatenate([strokes(400, rng), rest_N, rest_N + strokes(300, rng)])
    assert not any(seen(forces_N + rng.normal(0.0, NOISE_N, forces_N.size)))


def test_a_trial_has_no_past_of_another() -> None:
    recurrence = Recurrence()
    for _ in range(2):
        recurrence.begin_trial()
        for force_N in strokes(100, np.random.default_rng(0)):
            recurrence.felt(float(force_N))
            assert not recurrence.comes_again(NOISE_N)
