"""The insertion with a tool that turns, leans and gives way."""

from __future__ import annotations

from typing_extensions import override

from palpate.core.motion import TipMotion
from palpate.core.tasks.contact import RestlessForce
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
        felt: RestlessForce | None = None
        if checks is not None:
            speed_m_s = equipment.task.travel_speed_mm_s * 1e-3
            felt = RestlessForce(equipment.state, equipment.measurement, self._control, speed_m_s)
        return SpatialExplore(equipment, checks, felt, self._options)

    @override
    def _insert_with(self, equipment: Equipment, checks: SinkingChecks | None) -> SpatialInsert:
        return SpatialInsert(equipment, checks, self._options)
