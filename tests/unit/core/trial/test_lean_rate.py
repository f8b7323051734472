"""How fast a tool can lean, by the arm that holds it."""

import numpy as np
import pytest

from palpate.adapters.config import compose
from palpate.core.job import ToolConfig
from palpate.core.motion import Kinematics, arm_named
from palpate.core.trial import TaskConfig, find_ready_pose, largest_lean_rate

TOOL = ToolConfig().geometry


@pytest.mark.parametrize("arm", ["panda", "ur5"])
def test_no_joint_is_faster_than_its_lag_allows_on_any_heading(arm: str) -> None:
    ready = find_ready_pose(arm, TOOL, TaskConfig())
    rate_rad_s = largest_lean_rate(arm, TOOL, ready, behind_rad=8e-3, lag_s=0.02)
    inverse = np.linalg.pinv(Kinematics(arm_named(arm), TOOL).tip_jacobian(ready.q_rad))
    turns = [[0, 0, 0, np.cos(a), np.sin(a), 0] for a in np.linspace(0.0, 2 * np.pi, 721)]
    fastest_rad_s = max(float(np.abs(inverse @ turn).max()) for turn in np.array(turns)) * rate_rad_s
    assert fastest_rad_s * 0.02 == pytest.approx(8e-3, rel=1e-4)


def test_a_job_leans_more_slowly_on_an_arm_whose_wrist_is_near_a_singularity() -> None:
    square = {"part": {"shape": "square"}}
    steps_deg = [
        compose("job", "q-learning", square, {"arm": arm}, task="insertion-6dof").task.options["lean_step_deg"]
        for arm in ("zebra-zero", "panda")
    ]
    assert steps_deg[0] == 1.1
    assert 0.7 < steps_deg[1] < 0.85
    own = {"task": {"options": {"lean_step_deg": 0.5}}, "arm": "panda"}
    assert compose("job", "q-learning", square, own, task="insertion-6dof").task.options["lean_step_deg"] == 0.5
