"""Observations: of the right kind, inside their bounds, and new every time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from palpate.adapters.config.run import RunConfig
from palpate.adapters.gymnasium_envs.spaces import StateIndex, TipWrench
from palpate.core.insertion.config import TaskConfig


@dataclass
class Felt:
    """What an observation takes from a task."""

    percept: tuple[int, int] | None = None
    tip_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    wrench_at_tip: Any = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def test_the_symbolic_observation_is_the_number_of_the_state() -> None:
    states = StateIndex(17)
    for percept, expected in ((None, 0), ((3, 5), 5), ((3, 16), 16)):
        seen = states.of(Felt(percept))  # type: ignore[arg-type]
        assert seen == expected
        assert states.space.contains(seen)


def test_the_raw_observation_is_tip_force_and_torque_in_this_order() -> None:
    raw = TipWrench(RunConfig())
    felt = Felt(None, (1e-3, -2e-3, 3e-3), ((0.5, -0.25, -4.5), (0.0625, -0.125, 0.03125)))
    seen = raw.of(felt)  # type: ignore[arg-type]
    assert seen.dtype == np.float32
    assert seen == pytest.approx([1e-3, -2e-3, 3e-3, 0.5, -0.25, -4.5, 0.0625, -0.125, 0.03125])
    assert not np.shares_memory(seen, raw.of(felt))  # type: ignore[arg-type]


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_what_is_beyond_the_bounds_is_cut_off_there(sign: float) -> None:
    raw = TipWrench(RunConfig())
    far = (sign, sign, sign)
    seen = raw.of(Felt(None, far, ((99 * sign,) * 3, (99 * sign,) * 3)))  # type: ignore[arg-type]
    assert raw.space.contains(seen)
    assert seen.tolist() == (raw.space.high if sign > 0 else raw.space.low).tolist()


def test_the_bounds_follow_the_task() -> None:
    space = TipWrench(RunConfig(task=TaskConfig(max_force_N=20.0, area_half_width_mm=6.0))).space
    assert space.high[3:6].tolist() == [20.0] * 3
    assert space.high[6:] == pytest.approx([20.0 * 14.5e-3] * 3)
    assert space.high[0] > 6e-3
    assert space.low[2] == pytest.approx(-5e-3)
    assert np.isfinite(space.low).all()
