"""The interface to a kind of task, through which generic code sets up, runs, scores, records and replays trials."""

import difflib
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from palpate.core.errors import ConfigurationError
from palpate.core.motion import ArmDescription, TipMotion, ToolGeometry
from palpate.core.perception import Perception
from palpate.core.policy import Action, Policy, Reinforcement, compass_actions
from palpate.core.ports import GroundTruth, Settings, kinds_of
from palpate.core.trial.config import ControlConfig, TaskConfig
from palpate.core.trial.measurement import Measurement
from palpate.core.trial.ready_pose import ReadyPose, Workspace
from palpate.core.trial.report import Outcome, TrialReport, TrialSetup
from palpate.core.trial.task import Task

S = TypeVar("S", bound=Settings)


@dataclass(frozen=True, slots=True)
class TaskParts:
    """Components of one task, not shared with other tasks.

    Attributes:
        measurement: Measurement that transforms snapshots to the task frame.
        perception: Perception that maps signals to states; only for tasks in which a policy chooses.
        policy: Policy that chooses actions; only for such tasks.
        reinforcement: Reinforcement that computes the reward for an action; only for such tasks.
    """

    task: TaskConfig
    control: ControlConfig
    measurement: Measurement
    motion: TipMotion
    perception: Perception
    policy: Policy
    reinforcement: Reinforcement


@dataclass(frozen=True, slots=True)
class Fit:
    """Fit between the tool and the part in the simulated cell, for scoring.

    Attributes:
        clearance_mm: Radial gap between tool and part, at its widest.
        total_tilt_mrad: Tool tilt in the gripper plus part tilt.
    """

    diameter_mm: float
    clearance_mm: float
    total_tilt_mrad: float
    depth_mm: float


class TaskKind(Protocol):
    """Interface for the object behind an entry point in the group ``palpate.tasks``; its name selects the task.

    Attributes:
        preset: Nested tables of initial settings for a run, which override the scenario's.
        options: The class that reads ``task.options``.
    """

    preset: Mapping[str, Any]
    queries_policy: bool
    options: type[Settings]

    @abstractmethod
    def workspace(self, task: TaskConfig) -> Workspace:
        """Return the box that the tip must be able to reach."""

    @abstractmethod
    def ready(self, arm: str | ArmDescription, tool: ToolGeometry, task: TaskConfig) -> ReadyPose:
        """Return the initial pose for trials.

        Raises:
            ConfigurationError: The task's settings contradict each other, or the arm is unknown.
            UnreachableError: The task is outside the arm's workspace.
        """

    @abstractmethod
    def setup(self, task: TaskConfig, seed: int, trial: int) -> TrialSetup:
        """Return the setup for a trial, which depends only on settings, seed and index."""

    def actions(self, task: TaskConfig) -> tuple[Action, ...]:
        """Return the actions for policies: steps in the plane, unless a task defines others."""
        return compass_actions(task.step_mm * 1e-3, task.directions)

    def learner_options(self, task: TaskConfig) -> tuple[Action, ...]:
        """Return the programmed options for policies, each of which runs until it terminates; none by default."""
        return ()

    def can_start(self, option: str, state: str) -> bool:
        """Return True if an option's initiation set contains a state; learners try the option only there."""
        return True

    def by_rule(self, option: str, state: str) -> bool:
        """Return True if the task's own rule would take an option in a state; learners prefer that option at first."""
        return True

    @abstractmethod
    def make(self, parts: TaskParts) -> Task:
        """Build the task for any ports.

        Raises:
            ConfigurationError: A setting is rejected.
        """

    @abstractmethod
    def achieved(self, task: TaskConfig, report: TrialReport, truth: GroundTruth, fit: Fit) -> bool:
        """Return True if both the report and the ground truth of a trial indicate success."""

    def untrue(self, task: TaskConfig, report: TrialReport, truth: GroundTruth, fit: Fit) -> bool:
        """Return True if the report claims a success that the ground truth contradicts: the worst effect of a fault."""
        return report.outcome is Outcome.DONE and not self.achieved(task, report, truth, fit)


def options_of(table: type[S], task: TaskConfig) -> S:
    """Read the task's own settings; missing ones take their defaults.

    Raises:
        ConfigurationError: An option is unknown or its value is rejected.
    """
    known = kinds_of(table)
    for name, value in task.options.items():
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
            hint = f"; did you mean {near[0]}?" if near else ""
            accepted = f"no option of {task.name} (known: {', '.join(known) or 'none'}){hint}"
            raise ConfigurationError(f"task.options.{name}", value, accepted)
    return table(**task.options)
