"""What the phases of a trial work with."""

from dataclasses import dataclass
from typing import Final, Self

from palpate.core.motion import ControlLaw, DampingControl, ForceControl, HybridControl, PositionControl, TipMotion
from palpate.core.ports import PERIOD_S
from palpate.core.tasks.contact import ContactProof, LiftCheck
from palpate.core.tasks.insertion.agent import Agent
from palpate.core.tasks.insertion.trial_state import InsertionState
from palpate.core.trial import N_PER_KGF, ControlConfig, Measurement, TaskConfig

_ACROSS_SPEED_M_S: Final = 0.005


@dataclass(frozen=True, slots=True)
class Laws:
    """One law for each kind of motion.

    Attributes:
        press: Across as if free, pressing along the tool axis.
        along: The pressing alone.
        inserting: Down a hole, with the lateral force regulated to zero; it ignores its target.
    """

    free: ControlLaw
    press: ControlLaw
    along: ControlLaw
    inserting: ControlLaw

    @classmethod
    def of(cls, task: TaskConfig, control: ControlConfig) -> Self:
        """The laws with these gains.

        Raises:
            ConfigurationError: A gain is too high for the gripper's stiffness.
        """
        travel = task.travel_speed_mm_s * 1e-3
        lateral_N_per_m = control.lateral_stiffness_N_per_mm * 1e3
        axial_N_per_m = control.axial_stiffness_N_per_mm * 1e3
        press = (0.0, 0.0, -task.press_kgf * N_PER_KGF)
        along = DampingControl(control.damping_N_s_per_m, press, travel, axial_N_per_m, PERIOD_S)
        free = PositionControl(control.position_gain_per_s, travel, PERIOD_S)
        inserting = HybridControl(
            ForceControl(
                control.force_integral_m_per_N_s,
                control.force_proportional_m_per_N,
                (0.0, 0.0, 0.0),
                _ACROSS_SPEED_M_S,
                lateral_N_per_m,
                PERIOD_S,
            ),
            along,
        )
        return cls(free, HybridControl(free, along), along, inserting)


@dataclass(frozen=True, slots=True)
class Equipment:
    """What the phases share.

    Attributes:
        measurement: The newest tick in the task frame.
        motion: Where the tip is commanded to be.
    """

    task: TaskConfig
    measurement: Measurement
    motion: TipMotion
    laws: Laws
    agent: Agent
    state: InsertionState

    def lift_check(self, proof: ContactProof) -> LiftCheck:
        """A lift that holds the force against the gripper's spring."""
        return LiftCheck(self.state, self.measurement, self.motion, proof)
