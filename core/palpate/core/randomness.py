"""One random generator per purpose and trial, all spawned from the run's seed.

The stream of a trial depends on (seed, purpose, trial index) alone: not on the trials before it, not on the worker
that runs it, not on how many numbers another purpose drew. So any trial can be repeated alone.
"""

from __future__ import annotations

import enum

import numpy as np


class Purpose(enum.IntEnum):
    """What random numbers are drawn for. The values are part of every log: never renumber them."""

    START = 0
    HOLE = 1
    SENSOR = 2
    POLICY = 3
    PARTITION = 4
    FITTING = 5
    WALKS = 6


def generator(seed: int, purpose: Purpose, trial: int = 0) -> np.random.Generator:
    """The generator for one purpose of one trial."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(int(purpose), trial)))
