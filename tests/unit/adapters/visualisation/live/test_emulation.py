"""The emulated cell, which has no trials, is shown as one long one."""

from typing_extensions import override

from palpate.adapters.config import RunConfig
from palpate.adapters.hardware import CellMoment
from palpate.adapters.visualisation.live import EmulationView
from palpate.adapters.visualisation.live.trial_stream import POSE_TICKS, TrialStream
from palpate.adapters.visualisation.live.viewer_process import WholeFrames
from palpate.core.ports import Truth
from tests.support.memory_sink import MemorySink
from tests.unit.adapters.samples import ready_pose
from tests.unit.adapters.visualisation.live.kept_display import KeptDisplay


class Frontally(MemorySink):
    """Shows at once what it is given."""

    def __init__(self, display: KeptDisplay) -> None:
        super().__init__()
        self.stream = TrialStream(display)

    @override
    def put(self, frames: bytes, *, vital: bool = False) -> bool:
        for _, message in WholeFrames().of(frames):
            self.stream.take(message)
        return True


def test_arm_wrench_and_insertions_are_shown() -> None:
    display, ready = KeptDisplay(), ready_pose()
    sink = Frontally(display)
    truth = Truth((0.001, -0.002, 0.0), (0.0, 0.0, 0.01), 0.01, 12.5)
    view, joints = EmulationView(sink, RunConfig(), ready, truth), tuple(ready.q_rad.tolist())
    for tick in range(1, 4 * POSE_TICKS + 1):
        asked = (joints[0] + 0.002, *joints[1:])
        view.moment(
            CellMoment(tick * 10_000_000 + 3_000_000, tick * 10_000_000, asked, joints, (1.0, 2.0, -3.0), (0.0,) * 3)
        )
    view.inserted(1, truth)
    sink.stream.flush()
    assert len(display.poses) == 4
    assert [row[:3] for _, row in display.rows["wrench"]] == [(1.0, 2.0, -3.0)] * 4
    assert [round(row[0], 9) for _, row in display.rows["timing"]] == [3.0] * 4
    assert [round(row[0], 9) for _, row in display.rows["command"]] == [2.0] * 4
    plate = display.poses[0][1]["plate"].position_m
    goal = RunConfig().task.goal
    assert [round(abs(plate[0] - goal.x_mm * 1e-3), 6), round(abs(plate[1] - goal.y_mm * 1e-3), 6)] == [0.001, 0.002]
    assert display.events[-1][0] == "inserted: 1: 10.00 mm deep, peak force so far 12.5 N"
