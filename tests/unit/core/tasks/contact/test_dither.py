"""The dither: bounded, no faster than it may be, and different in each trial."""

import numpy as np
import pytest

from palpate.core.ports import PERIOD_S
from palpate.core.tasks.contact import Dither


def places(amplitude_m, speed_m_s, seed=1, ticks=600):
    dither = Dither(amplitude_m, speed_m_s)
    dither.begin(np.random.default_rng(seed))
    return np.cumsum([dither.velocity_m_s() * PERIOD_S for _ in range(ticks)])


@pytest.mark.parametrize(("amplitude_m", "speed_m_s"), [(3e-4, 0.1), (3e-4, 0.02), (3e-4, 0.005), (1e-5, 0.02)])
def test_it_stays_within_amplitude_and_speed(amplitude_m, speed_m_s):
    moved = places(amplitude_m, speed_m_s)
    assert np.abs(moved).max() <= amplitude_m * (1.0 + 1e-9)
    assert np.abs(np.diff(moved)).max() <= speed_m_s * PERIOD_S * (1.0 + 1e-9)


def test_a_slow_one_reaches_what_it_says():
    dither = Dither(3e-4, 0.005)
    assert dither.usual_m(3e-4) < 1e-4
    swings = np.diff(places(3e-4, 0.005)[np.flatnonzero(np.diff(np.sign(np.diff(places(3e-4, 0.005))))) + 1])
    assert np.abs(swings).mean() == pytest.approx(2.0 * dither.usual_m(3e-4), rel=0.15)
    assert Dither(3e-4, 0.1).usual_m(3e-4) == 3e-4


def test_half_periods_are_drawn_for_each_trial():
    moved = places(3e-4, 0.1)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(moved))))
    assert set(np.diff(turns)) <= set(range(2, 9))
    assert len(set(np.diff(turns))) >= 4
    other = places(3e-4, 0.1, seed=2)
    assert abs(np.corrcoef(np.diff(moved), np.diff(other))[0, 1]) < 0.3
