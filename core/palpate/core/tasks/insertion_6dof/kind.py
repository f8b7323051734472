"""Insertion in six degrees of freedom as a kind of task, for use by the rest of palpate."""

from __future__ import annotations

from collections.abc import Mapping
from math import radians
from typing import Any, Final

from typing_extensions import override

from palpate.core.motion import ArmDescription, TipMotion, ToolGeometry
from palpate.core.perception import TaskFacts
from palpate.core.policy import Action
from palpate.core.ports import PERIOD_S, Settings
from palpate.core.tasks.contact import ContactTask, Monitor
from palpate.core.tasks.insertion import Agent, Insertion, InsertionState, InsertionTask
from palpate.core.tasks.insertion.phases import Approach, Controllers, Equipment
from palpate.core.tasks.insertion_6dof.explore import SpatialExplore
from palpate.core.tasks.insertion_6dof.insert import SpatialInsert
from palpate.core.tasks.insertion_6dof.option_agent import OPTIONS, OptionAgent, OptionRunner, by_rule, can_start
from palpate.core.tasks.insertion_6dof.options import SpatialOptions
from palpate.core.trial import (
    ControlConfig,
    Measurement,
    ReadyPose,
    TaskConfig,
    TaskParts,
    Workspace,
    find_ready_pose,
    options_of,
    require_turns,
)

_G_M_S2 = 9.81


class SpatialTask(InsertionTask):
    """An insertion whose actions have six degrees of freedom."""

    def __init__(
        self,
        task: TaskConfig,
        control: ControlConfig,
        measurement: Measurement,
        motion: TipMotion,
        agent: Agent,
    ) -> None:
        self._options = options_of(SpatialOptions, task)
        measurement.take_off_weight(self._options.tool_kg * _G_M_S2, self._options.tool_above_tip_mm * 1e-3)
        self._agent = agent
        state, controllers = InsertionState(agent, measurement), Controllers.of(task, control)
        equipment = Equipment(task, measurement, motion, controllers, agent, state)
        monitor = Monitor(state, task, control, measurement.depth_step_m, turns_rad=radians(self._options.tilt_deg))
        ContactTask.__init__(self, task, measurement, motion, controllers.free, state, monitor)
        self._approach = Approach(equipment, monitor)
        self._explore = SpatialExplore(equipment, monitor, self._options)
        self._insert = SpatialInsert(equipment, monitor, control, self._options)


_MARGIN_DEG: Final = 2.0
"""Supervisor margin over the maximum commanded turn."""


class Insertion6Dof(Insertion):
    """Insertion of a peg with corners, or of a tilted peg, into a hole of unknown orientation."""

    preset: Mapping[str, Any] = {
        "part": {"depth_tolerance_mm": 0.5},
        "cell": {"contacts": "searched"},
    }
    options: type[Settings] = SpatialOptions

    @override
    def workspace(self, task: TaskConfig) -> Workspace:
        own, flat = options_of(SpatialOptions, task), super().workspace(task)
        turns_deg = own.most_tilt_deg + _MARGIN_DEG, own.most_yaw_deg + _MARGIN_DEG
        return Workspace(flat.side_mm, flat.above_mm, flat.below_mm, turns_deg)

    @override
    def ready(self, arm: str | ArmDescription, tool: ToolGeometry, task: TaskConfig) -> ReadyPose:
        own, ready = options_of(SpatialOptions, task), find_ready_pose(arm, tool, task)
        require_turns(arm, tool, ready, task, (own.most_tilt_deg, own.most_yaw_deg))
        return ready

    @override
    def learner_options(self, task: TaskConfig) -> tuple[Action, ...]:
        # A flat is recognised at depths other than those of corners.
        return () if options_of(SpatialOptions, task).flat_deg else OPTIONS

    @override
    def can_start(self, option: str, state: str) -> bool:
        return can_start(option, state)

    @override
    def by_rule(self, option: str, state: str) -> bool:
        return by_rule(option, state)

    @override
    def make(self, parts: TaskParts) -> SpatialTask:
        learning = parts.perception, parts.policy, parts.reinforcement, PERIOD_S
        # A perception of corner situations chooses among options, any other among steps.
        distinguished = isinstance(parts.perception.extractor, TaskFacts)
        learner_options = OptionRunner(options_of(SpatialOptions, parts.task), parts.task.area_half_width_mm * 1e-3)
        agent = OptionAgent(*learning, learner_options) if distinguished else Agent(*learning)
        return SpatialTask(parts.task, parts.control, parts.measurement, parts.motion, agent)


INSERTION_6DOF: Final = Insertion6Dof()
