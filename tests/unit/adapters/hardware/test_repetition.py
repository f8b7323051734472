"""Readings of before under new numbers are told; a sensor whose step is coarser than its noise is not blamed for it."""

import numpy as np
import pytest

from palpate.adapters.hardware.repetition import Repetition
from palpate.drivers.device import ForceSample

MS = 1_000_000


def told(counts: np.ndarray, *, most_ms: int = 20, period_ms: int = 5, each: int = 1) -> list[tuple[int, str]]:
    """What is told, and after how many readings, of counts (n, 6) that are polled so many at a time."""
    watch, found = Repetition(most_ms * MS), []
    for first in range(0, len(counts), each):
        some = [
            ForceSample(tuple(c[:3]), tuple(c[3:]), n, n) for n, c in enumerate(counts[first : first + each].tolist())
        ]
        if (problem := watch.told(some, period_ms * MS)) is not None:
            found.append((first + len(some), problem))
    return found


def noisy(readings: int, sd: float, seed: int = 5) -> np.ndarray:
    return np.rint(np.random.default_rng(seed).normal(0.0, sd, (readings, 6)) + 120.3)


@pytest.mark.parametrize(("before", "each"), [(1, 1), (1, 3), (80, 1), (400, 7)])
def test_readings_of_before_are_told_after_some_of_them(before: int, each: int) -> None:
    counts = noisy(1000, 3.0)
    counts[600:] = counts[600 - before] if before == 1 else counts[600 - before : 1000 - before]
    (at, problem), *_ = told(counts, each=each)
    assert 604 <= at <= 605 + each
    assert f"readings are those of {5 * before} ms before in each digit" in problem


@pytest.mark.parametrize(
    "counts",
    [
        noisy(3000, 3.0),
        np.zeros((3000, 6)),
        noisy(3000, 0.2),  # mostly one and the same count
        np.repeat(noisy(500, 3.0), 6, axis=0),  # read more often than it measures
        np.concatenate([noisy(290, 3.0), np.zeros((40, 6)), noisy(2000, 3.0, 6)]),  # not known yet
        np.concatenate([noisy(1000, 3.0), np.zeros((5, 6)), noisy(1000, 3.0, 6)]),  # for 20 ms
    ],
)  # fmt: skip
def test_what_noise_and_a_coarse_step_do_is_nothing(counts: np.ndarray) -> None:
    assert told(counts) == []


def test_nothing_is_asked_where_lateness_is_borne() -> None:
    assert told(np.concatenate([noisy(1000, 3.0), np.zeros((1000, 6))]), most_ms=0) == []


def test_what_was_told_is_no_measure_of_the_sensor() -> None:
    at = [
        at
        for at, _ in told(np.concatenate([noisy(1000, 3.0), np.zeros((200, 6)), noisy(1000, 3.0, 6), np.zeros((9, 6))]))
    ]
    assert at == [*range(1006, 1201), *range(2206, 2210)]
