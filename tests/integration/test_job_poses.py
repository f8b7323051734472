"""A job may put sensor, tip and hole into any pose: the same rule inserts."""

import pytest

from palpate.adapters.config import compose
from palpate.adapters.experiments import Run


@pytest.mark.parametrize(
    ("tool", "place"),
    [
        ({"sensor_rpy_deg": (0.0, 0.0, 30.0)}, {}),
        ({"tip_rpy_deg": (0.0, 10.0, 0.0), "tip_mm": (20.0, 0.0, 130.0)}, {}),
        pytest.param({"tip_mm": (0.0, 0.0, 250.0)}, {"z_mm": 0.0}, marks=pytest.mark.nightly),
        pytest.param({}, {"rpy_deg": (20.0, 0.0, 0.0)}, marks=pytest.mark.nightly),
        ({}, {"rpy_deg": (0.0, 90.0, 0.0), "x_mm": 500.0, "z_mm": 300.0}),
    ],
    ids=["turned sensor", "bent tool", "long tool", "inclined plate", "hole in a wall"],
)
def test_torque_rule_inserts_whatever_the_poses_are(tool, place):
    config = compose("job", "q-learning", {"arm": "ur10"}, job={"part": {}, "tool": tool, "place": place})
    assert [row.success for row in Run(config).evaluate(2, "torque").rows] == [True, True]
