"""What the phases of a trial work with."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Protocol

from palpate.core.motion import TipMotion
from palpate.core.ports import Vector3
from palpate.core.tasks.insertion.agent import Agent
from palpate.core.tasks.insertion.laws import Laws
from palpate.core.tasks.insertion.trial_state import TrialState
from palpate.core.trial import Measurement, TaskConfig


@dataclass(frozen=True, slots=True)
class Equipment:
    """What the phases share.

    Attributes:
        task: What is to be done.
        axial_N_per_m: Stiffness of the gripper along the tool axis.
        measurement: The newest tick in the task frame.
        motion: Where the tip is commanded to be.
        laws: The laws of motion.
        agent: Perception, policy and learning.
        state: Where the trial stands.
    """

    task: TaskConfig
    axial_N_per_m: float
    measurement: Measurement
    motion: TipMotion
    laws: Laws
    agent: Agent
    state: TrialState


class RunningPhase(Protocol):
    """One phase of a trial at work; how it is entered is its own.

    Attributes:
        over: Whether the last :meth:`step` was the phase's last one. A trial that ends in a phase leaves it False.
    """

    over: bool

    @abstractmethod
    def step(self) -> Vector3:
        """Velocity of the tip, (3,) m/s, task frame, for this tick."""
