"""The insertion with a tool that turns, leans and gives way."""

from __future__ import annotations

from typing_extensions import override

from palpate.core.motion import TipMotion
from palpate.core.tasks.contact import AnsweredForce, RestlessForce
from palpate.core.tasks.insertion import Agent, InsertionTask
from palpate.core.tasks.insertion.phases import Equipment, ExploringChecks, SinkingChecks
from palpate.core.tasks.insertion_6dof.explore import SpatialExplore
from palpate.core.tasks.insertion_6dof.insert import SpatialInsert
from palpate.core.tasks.insertion_6dof.options import SpatialOptions
from palpate.core.trial import ControlConfig, Measurement, TaskConfig, options_of

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
        self._options, self._control = options_of(SpatialOptions, task), control
        measurement.take_off_weight(self._options.tool_kg * _G_M_S2, self._options.tool_above_tip_mm * 1e-3)
        super().__init__(task, control, measurement, motion, agent)

    @override
    def _explore_with(self, equipment: Equipment, checks: ExploringChecks | None) -> SpatialExplore:
        felt: AnsweredForce | RestlessForce | None = None
        if checks is not None:
            own, task, state, measurement = self._options, equipment.task, equipment.state, equipment.measurement
            parts = state, measurement, self._control, task.travel_speed_mm_s * 1e-3
            if own.unanswered_N:
                felt = AnsweredForce(*parts, own.unanswered_N, own.tool_kg, measurement.depth_step_m)
            else:
                felt = RestlessForce(*parts)
        return SpatialExplore(equipment, checks, felt, self._options)

    @override
    def _insert_with(self, equipment: Equipment, checks: SinkingChecks | None) -> SpatialInsert:
        return SpatialInsert(equipment, checks, self._options)
