"""The emulated tool force is as coarse as its data sheet."""

import numpy as np
import pytest

from palpate.simulation.emulators.ur.tool_force import ToolForce


def test_noise_and_drift_are_the_data_sheet_s() -> None:
    reading = ToolForce(lambda now_ns: (1.0, 2.0, 3.0, 0.0, 0.0, 0.0), seed=1)
    at_once = np.array([reading(0) for _ in range(2000)])
    assert at_once.std(axis=0) == pytest.approx([1.75] * 3 + [0.1] * 3, rel=0.06)
    seldom = np.array([reading(i * 300_000_000_000) for i in range(2000)])
    assert seldom.std(axis=0) == pytest.approx([2.0] * 3 + [0.15] * 3, rel=0.06)
    assert seldom.mean(axis=0) == pytest.approx([1.0, 2.0, 3.0, 0.0, 0.0, 0.0], abs=0.15)
