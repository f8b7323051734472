"""What the phases of a trial work with."""

from dataclasses import dataclass

from palpate.core.motion import TipMotion
from palpate.core.tasks.contact import ContactProof, LiftCheck
from palpate.core.tasks.insertion.agent import Agent
from palpate.core.tasks.insertion.laws import Laws
from palpate.core.tasks.insertion.trial_state import InsertionState
from palpate.core.trial import Measurement, TaskConfig


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
