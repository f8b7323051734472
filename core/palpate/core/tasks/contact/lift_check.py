"""A lift that is made within a phase, to hold the force against the gripper's spring."""

from palpate.core.motion import TipMotion
from palpate.core.tasks.contact.proof import ContactProof
from palpate.core.tasks.contact.trial_state import TrialState
from palpate.core.trial import Measurement


class LiftCheck:
    """Lifts a tool that presses, by a little, and doubts the force sensor where the force does not follow.

    Attributes:
        running: Whether it has begun and is not over; the phase that lifts sets it as it is entered.
    """

    def __init__(self, state: TrialState, measurement: Measurement, motion: TipMotion, proof: ContactProof) -> None:
        self._state, self._measurement, self._motion = state, measurement, motion
        self._proof = proof
        self.running: bool

    def begin(self) -> None:
        """The next :meth:`velocity_m_s` is the first of a lift."""
        self.running = True
        self._proof.axial.begin()

    def velocity_m_s(self) -> float | None:
        """Velocity along the tool axis for this tick; None when it is over, with a doubt where it failed."""
        proof, measured = self._proof, self._measurement
        along = proof.axial.velocity_m_s(
            measured.force_N[2], proof.new, self._motion.reference_m[2], measured.position_m[2]
        )
        if along is None:
            self.running = False
            if proof.axial.share is not None and not proof.axial.passed:
                self._state.doubt(proof.no_spring(self._state.tick))
        return along
