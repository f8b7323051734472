"""A kind of task, for whoever sets trials up, runs, scores, records and replays them without knowing the task."""

import difflib
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from palpate.core.errors import ConfigurationError
from palpate.core.motion import ArmDescription, TipMotion, ToolGeometry
from palpate.core.perception import Perception
from palpate.core.policy import Action, Policy, Reinforcement, compass_actions
from palpate.core.ports import Settings, Truth, kinds_of
from palpate.core.trial.config import ControlConfig, TaskConfig
from palpate.core.trial.measurement import Measurement
from palpate.core.trial.ready_pose import ReadyPose, Workspace
from palpate.core.trial.report import Outcome, TrialReport, TrialSetup
from palpate.core.trial.task import Task

S = TypeVar("S", bound=Settings)


@dataclass(frozen=True, slots=True)
class TaskParts:
    """What a task is made of, each part its own.

    Attributes:
        measurement: From snapshots to the task frame.
        perception: From signals to states; for tasks that let a policy choose.
        policy: Chooses actions; for those, too.
        reinforcement: What an action earns; for those, too.
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
    """How tool and part fit, as the world was set up; for scoring.

    Attributes:
        clearance_mm: Gap between tool and part all round, at its widest.
        lean_mrad: Tilt of the tool in the gripper, and of the part under it.
    """

    diameter_mm: float
    clearance_mm: float
    lean_mrad: float
    depth_mm: float


class TaskKind(Protocol):
    """What an entry point of the group ``palpate.tasks`` leads to, by the name under which the task is run.

    Attributes:
        preset: Nested tables of settings that a run of this task begins from, over those of the scenario.
        options: The table that ``task.options`` is read as.
    """

    preset: Mapping[str, Any]
    asks_policy: bool
    options: type[Settings]

    @abstractmethod
    def workspace(self, task: TaskConfig) -> Workspace:
        """Where the tip has to be able to be."""

    @abstractmethod
    def ready(self, arm: str | ArmDescription, tool: ToolGeometry, task: TaskConfig) -> ReadyPose:
        """The pose from which trials begin.

        Raises:
            ConfigurationError: The task's settings do not go together, or there is no such arm.
            UnreachableError: The arm cannot do the task there.
        """

    @abstractmethod
    def setup(self, task: TaskConfig, seed: int, trial: int) -> TrialSetup:
        """The setup of a trial: a function of settings, seed and index."""

    def actions(self, task: TaskConfig) -> tuple[Action, ...]:
        """The actions that policies choose from: steps across, unless a task has others."""
        return compass_actions(task.step_mm * 1e-3, task.directions)

    def skills(self, task: TaskConfig) -> tuple[Action, ...]:
        """Programmed skills that policies may choose from instead, each until it is over; none, unless it has."""
        return ()

    def may_begin(self, skill: str, state: str) -> bool:
        """Whether a skill is one for this state, both by name; where it is not, no learner tries it."""
        return True

    def by_rule(self, skill: str, state: str) -> bool:
        """Whether the task's own rule would take a skill in this state; learners begin with what it would."""
        return True

    @abstractmethod
    def make(self, parts: TaskParts) -> Task:
        """The task, ready to run over any ports.

        Raises:
            ConfigurationError: A setting is refused.
        """

    @abstractmethod
    def achieved(self, task: TaskConfig, report: TrialReport, truth: Truth, fit: Fit) -> bool:
        """Whether a trial is a success, by its own account and by the truth."""

    def untrue(self, task: TaskConfig, report: TrialReport, truth: Truth, fit: Fit) -> bool:
        """Whether a trial's own account is one that the truth contradicts: the worst that a fault can lead to."""
        return report.outcome is Outcome.DONE and not self.achieved(task, report, truth, fit)


def options_of(table: type[S], task: TaskConfig) -> S:
    """The task's own settings, those that are not given by their defaults.

    Raises:
        ConfigurationError: There is no such option, or its value is refused.
    """
    known = kinds_of(table)
    for name, value in task.options.items():
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
            hint = f"; did you mean {near[0]}?" if near else ""
            accepted = f"no option of {task.name} (known: {', '.join(known) or 'none'}){hint}"
            raise ConfigurationError(f"task.options.{name}", value, accepted)
    return table(**task.options)
