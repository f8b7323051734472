"""Following a surface as a kind of task, as the rest of palpate uses it."""

from collections.abc import Mapping
from typing import Any, Final

from typing_extensions import override

from palpate.core.motion import ArmDescription
from palpate.core.ports import Truth
from palpate.core.tasks.surface_follow.task import FollowOptions, FollowPhase, FollowTask
from palpate.core.trial import (
    Fit,
    Outcome,
    ReadyPose,
    TaskConfig,
    TaskKind,
    TaskParts,
    TrialReport,
    TrialSetup,
    Workspace,
    find_ready_pose,
    options_of,
    require_speed,
)


class SurfaceFollow(TaskKind):
    """A tool along a contour; no policy is asked, and nothing is drawn for the core."""

    preset: Mapping[str, Any] = {
        "task": {"goal": {"x_mm": 430.0}, "ready_height_mm": 8.0, "time_limit_s": 120.0},
        "control": {"damping_N_s_per_m": 100.0},
        # Sliding with friction chatters at coarser steps of physics: 0.55 N RMS at 4, 0.20 at 16, 0.16 at 32.
        "cell": {
            "contacts": "searched",
            "substeps": 16,
            "hole_uncertainty_mm": 40.0,
            "contour": {"shape": "sine"},
        },
    }
    asks_policy = False
    options = FollowOptions
    phases = (*TaskKind.phases, FollowPhase.FOLLOW)

    @override
    def workspace(self, task: TaskConfig) -> Workspace:
        own = options_of(FollowOptions, task)
        return Workspace((0.5 * own.stroke_mm, 0.0), task.ready_height_mm, own.relief_mm)

    @override
    def ready(self, arm: str | ArmDescription, task: TaskConfig) -> ReadyPose:
        own = options_of(FollowOptions, task)
        ready = find_ready_pose(arm, task, self.workspace(task))
        require_speed(arm, ready, own.speed_mm_s * 1e-3)
        return ready

    @override
    def setup(self, task: TaskConfig, seed: int, trial: int) -> TrialSetup:
        return TrialSetup(trial, seed, (-0.5e-3 * options_of(FollowOptions, task).stroke_mm, 0.0))

    @override
    def make(self, parts: TaskParts) -> FollowTask:
        return FollowTask(parts.task, parts.control, parts.measurement, parts.motion)

    @override
    def achieved(self, task: TaskConfig, report: TrialReport, truth: Truth, fit: Fit) -> bool:
        """All of the way within the tolerance, the true peak force below the limit."""
        return report.outcome is Outcome.DONE and truth.peak_force_N < task.max_force_N


SURFACE_FOLLOW: Final = SurfaceFollow()
