"""Insertion as a kind of task, for use by the rest of palpate."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import sin
from typing import Any, ClassVar, Final

from typing_extensions import override

from palpate.core.motion import ArmDescription, ToolGeometry
from palpate.core.ports import PERIOD_S, GroundTruth, Settings
from palpate.core.tasks.insertion.agent import Agent
from palpate.core.tasks.insertion.task import InsertionTask
from palpate.core.trial import (
    Fit,
    Outcome,
    Purpose,
    ReadyPose,
    TaskConfig,
    TaskKind,
    TaskParts,
    TrialReport,
    TrialSetup,
    Workspace,
    draw_in_disc,
    find_ready_pose,
    generator,
    options_of,
)

FULL_DEPTH_TOLERANCE_M: Final = 5e-5
"""Tolerance on the full depth."""
_ASIDE_M: Final = 1e-3


@dataclass(frozen=True)
class NoOptions(Settings):
    """Empty options for an insertion, which is configured in the ``task`` table."""

    TABLE: ClassVar[str] = "task.options"


class Insertion(TaskKind):
    """Insertion of a peg into a hole."""

    preset: Mapping[str, Any] = {}
    queries_policy = True
    options: type[Settings] = NoOptions

    def workspace(self, task: TaskConfig) -> Workspace:
        """Return the box that contains all starts, the exploration area and the full depth."""
        # If the area is centred at the start, the two add up.
        side_mm = task.start_uncertainty_mm + task.area_half_width_mm
        return Workspace((side_mm, side_mm), task.ready_height_mm, task.insertion_depth_mm)

    @override
    def ready(self, arm: str | ArmDescription, tool: ToolGeometry, task: TaskConfig) -> ReadyPose:
        options_of(NoOptions, task)
        return find_ready_pose(arm, tool, task)

    def setup(self, task: TaskConfig, seed: int, trial: int) -> TrialSetup:
        """Draw a start for each trial."""
        rng = generator(seed, Purpose.START, trial)
        return TrialSetup(trial, seed, draw_in_disc(rng, task.start_uncertainty_mm * 1e-3, task.start_shape))

    @override
    def make(self, parts: TaskParts) -> InsertionTask:
        agent = Agent(parts.perception, parts.policy, parts.reinforcement, PERIOD_S)
        return InsertionTask(parts.task, parts.control, parts.measurement, parts.motion, agent)

    def achieved(self, task: TaskConfig, report: TrialReport, truth: GroundTruth, fit: Fit) -> bool:
        """Return True if the peg is in the hole at full depth and the true peak force was below the limit."""
        # The centre of a tilted peg's end face is above its deepest edge, on which it rests in the hole.
        tilt_m = 0.5e-3 * fit.diameter_mm * sin(fit.total_tilt_mrad * 1e-3)
        return (
            report.outcome is Outcome.INSERTED
            and not _is_aside(truth, fit)
            and truth.depth_m >= task.insertion_depth_mm * 1e-3 - FULL_DEPTH_TOLERANCE_M - tilt_m
            and truth.peak_force_N < task.max_force_N
        )

    def untrue(self, task: TaskConfig, report: TrialReport, truth: GroundTruth, fit: Fit) -> bool:
        """Return True if the peg was reported as inserted but is next to the hole or not deep enough."""
        short = truth.depth_m < (task.insertion_depth_mm - task.depth_tolerance_mm) * 1e-3
        return report.outcome is Outcome.INSERTED and (short or _is_aside(truth, fit))


INSERTION: Final = Insertion()


def _is_aside(truth: GroundTruth, fit: Fit) -> bool:
    return truth.aside_m >= _ASIDE_M + fit.clearance_mm * 1e-3
