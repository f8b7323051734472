"""Objects shared by a trial's phases."""

from dataclasses import dataclass
from typing import Final, Self

from palpate.core.motion import Controller, DampingControl, ForceControl, HybridControl, PositionControl, TipMotion
from palpate.core.ports import PERIOD_S
from palpate.core.tasks.insertion.agent import Agent
from palpate.core.tasks.insertion.trial_state import InsertionState
from palpate.core.trial import N_PER_KGF, ControlConfig, Measurement, TaskConfig

_ACROSS_SPEED_M_S: Final = 0.005
_DROP_M: Final = 3e-4
"""Depth below the surface at which the tip is in the hole, past any chamfer or worn edge."""


@dataclass(frozen=True, slots=True)
class Controllers:
    """Controllers for each kind of motion.

    Attributes:
        press: Position control across the tool axis, with a constant press along it.
        along: Press along the tool axis only.
        inserting: Descent with the lateral force controlled to zero; the target is ignored.
    """

    free: Controller
    press: Controller
    along: Controller
    inserting: Controller

    @classmethod
    def of(cls, task: TaskConfig, control: ControlConfig) -> Self:
        """Create the controllers from their gains.

        Raises:
            ConfigurationError: A gain is too high for the gripper's stiffness.
        """
        travel = task.travel_speed_mm_s * 1e-3
        lateral_N_per_m = control.lateral_stiffness_N_per_mm * 1e3
        axial_N_per_m = control.axial_stiffness_N_per_mm * 1e3

        def pressing(force_N: float) -> DampingControl:
            return DampingControl(control.damping_N_s_per_m, (0.0, 0.0, -force_N), travel, axial_N_per_m, PERIOD_S)

        along = pressing(task.press_kgf * N_PER_KGF)
        free, slide = (
            PositionControl(control.position_gain_per_s, speed, PERIOD_S)
            for speed in (travel, min(travel, task.slide_speed_mm_s * 1e-3))
        )
        inserting = HybridControl(
            ForceControl(
                control.force_integral_m_per_N_s,
                control.force_proportional_m_per_N,
                (0.0, 0.0, 0.0),
                _ACROSS_SPEED_M_S,
                lateral_N_per_m,
                PERIOD_S,
            ),
            pressing(task.insertion_press_N),
        )
        return cls(free, HybridControl(slide, along), along, inserting)


@dataclass(frozen=True, slots=True)
class Equipment:
    """Objects that the phases share.

    Attributes:
        measurement: The latest tick in the task frame.
        motion: The commanded tip.
    """

    task: TaskConfig
    measurement: Measurement
    motion: TipMotion
    controllers: Controllers
    agent: Agent
    state: InsertionState

    @property
    def drop_m(self) -> float:
        """Return the minimum depth below the surface that tilt, noise and encoder steps cannot explain."""
        noise_m = self.state.noise[2] / self.measurement.axial_N_per_m
        tilted_m = 1.5e-3 * self.task.end_tilt_mm
        return max(_DROP_M, tilted_m + 4.0 * noise_m + 2.0 * self.measurement.depth_step_m)
