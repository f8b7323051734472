"""Insertions as a kind of task, as the rest of palpate uses them."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import sin
from typing import Any, ClassVar, Final

from typing_extensions import override

from palpate.core.motion import ArmDescription, ToolGeometry
from palpate.core.ports import PERIOD_S, Settings, Truth
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
"""A peg within this of the depth asked for is at full depth."""
_BESIDE_M: Final = 1e-3


@dataclass(frozen=True)
class NoOptions(Settings):
    """An insertion is set up by the table ``task`` itself."""

    TABLE: ClassVar[str] = "task.options"


class Insertion(TaskKind):
    """A peg into a hole."""

    preset: Mapping[str, Any] = {}
    asks_policy = True
    options: type[Settings] = NoOptions

    @override
    def workspace(self, task: TaskConfig) -> Workspace:
        """Room for all starts, the exploration and the whole depth."""
        # Where the area is centred at the start, the two add up.
        side_mm = task.start_uncertainty_mm + task.area_half_width_mm
        return Workspace((side_mm, side_mm), task.ready_height_mm, task.insertion_depth_mm)

    @override
    def ready(self, arm: str | ArmDescription, tool: ToolGeometry, task: TaskConfig) -> ReadyPose:
        options_of(NoOptions, task)
        return find_ready_pose(arm, tool, task)

    @override
    def setup(self, task: TaskConfig, seed: int, trial: int) -> TrialSetup:
        """Starts are drawn anew for each trial."""
        rng = generator(seed, Purpose.START, trial)
        return TrialSetup(trial, seed, draw_in_disc(rng, task.start_uncertainty_mm * 1e-3, task.start_shape))

    @override
    def make(self, parts: TaskParts) -> InsertionTask:
        agent = Agent(parts.perception, parts.policy, parts.reinforcement, PERIOD_S)
        return InsertionTask(parts.task, parts.control, parts.measurement, parts.motion, agent)

    @override
    def achieved(self, task: TaskConfig, report: TrialReport, truth: Truth, fit: Fit) -> bool:
        """In the hole and not beside the plate, at full depth, the true peak force below the limit."""
        # The centre of a leaning peg's end face is above its deepest edge, on which it stands in the hole.
        leaning_m = 0.5e-3 * fit.diameter_mm * sin(fit.lean_mrad * 1e-3)
        return (
            report.outcome is Outcome.INSERTED
            and not _beside(truth, fit)
            and truth.depth_m >= task.insertion_depth_mm * 1e-3 - FULL_DEPTH_TOLERANCE_M - leaning_m
            and truth.peak_force_N < task.max_force_N
        )

    @override
    def untrue(self, task: TaskConfig, report: TrialReport, truth: Truth, fit: Fit) -> bool:
        """The peg was taken for inserted where it was not: beside the hole, or not as deep as it had to be."""
        short = truth.depth_m < (task.insertion_depth_mm - task.depth_tolerance_mm) * 1e-3
        return report.outcome is Outcome.INSERTED and (short or _beside(truth, fit))


INSERTION: Final = Insertion()


def _beside(truth: Truth, fit: Fit) -> bool:
    return truth.aside_m >= _BESIDE_M + fit.clearance_mm * 1e-3
