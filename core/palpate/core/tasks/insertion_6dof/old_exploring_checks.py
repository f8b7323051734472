"""Proofs of contact while the peg explores: the first touch, signs of life, lifts where these are missing."""

from typing import Final

from palpate.core.ports import Vector3
from palpate.core.tasks.contact import HIGHEST_SHARE, LOWEST_SHARE, ContactProof, LiftCheck
from palpate.core.tasks.insertion.phases import Equipment
from palpate.core.trial import N_PER_KGF

_PRESSED_SHARE: Final = 0.6
"""Share of the pressing force, filtered, from which the plate is pressed enough for the lift."""
_BEHIND_NS: Final = 12_000_000
"""Encoders on a slow bus, so far behind the force, make a tip that heaves seem to sink: lifts are left then."""
_DOUBTED_SHARE: Final = 0.45
"""With a noise of 0.3 N a short touch may show so little of the stiffness, or more and still too little: 16 of 100 did,
and 2 of 100 a little later. Half of a sound sensor's force gives less."""
_LONGER_TICKS: Final = 8
"""So much later such a touch is looked at once more, a quarter of the time that a lift takes."""
_RISE_M: Final = 5e-4
_RISEN_TICKS: Final = 8
"""A tip that presses so far above the surface, for so long, presses on nothing."""


class ExploringChecks:
    """What is checked between the ticks of an action."""

    def __init__(self, equipment: Equipment, proof: ContactProof) -> None:
        self._equipment, self._proof, self._lift = (
            equipment,
            proof,
            LiftCheck(equipment.state, equipment.measurement, equipment.motion, proof),
        )
        self._press_N = equipment.task.press_kgf * N_PER_KGF

    def begin(self) -> None:
        """A trial begins."""
        self._touch_judged, self._longer_ticks, self._risen_ticks, self._behind_ns = False, 0, 0, 0

    def resume(self) -> None:
        """Exploration begins, or goes on after a drop that was none."""
        self._lift.running = False
        self._proof.life.resume()

    def step(self, countdown: int) -> Vector3 | None:
        """Velocity of the tip while a check is made, (3,) m/s, task frame; None when there is nothing to check."""
        equipment, proof = self._equipment, self._proof
        measured, state, reference_m = equipment.measurement, equipment.state, equipment.motion.reference_m
        snapshot = state.snapshot
        behind_ns = snapshot.wrench.source_time_ns - snapshot.joints.source_time_ns
        if behind_ns > self._behind_ns:
            self._behind_ns = behind_ns
        # From the first touch on, and while it is lifted too: a force that comes late swings with the spring.
        rise_m = state.surface_m - measured.tip_depth_m
        self._risen_ticks = self._risen_ticks + 1 if rise_m > _RISE_M else 0
        if self._risen_ticks > _RISEN_TICKS:
            state.doubt(proof.above_plate(state.tick, rise_m))
        if not self._lift.running:
            longer = not self._touch_judged and self._judge_touch(countdown)
            proof.life.watch(measured.force_N[2], proof.new, reference_m)
            if not proof.life.due and not longer:
                return None
            if longer or measured.filtered_force_z_N > -_PRESSED_SHARE * self._press_N:
                return equipment.laws.press.velocity_m_s(reference_m, reference_m, measured.force_N)
            self._lift.begin()
        else:
            proof.life.follow(reference_m[2])
        along = self._lift.velocity_m_s()
        if along is None and proof.axial.passed:
            state.event("proof", f"lift: {proof.axial.share:.2f} of the gripper's stiffness")
            proof.life.proved()
        return 0.0, 0.0, along or 0.0

    def heave_m_s(self) -> float:
        """Velocity along the tool axis that shows, while the tool slides, whether the force follows it."""
        return self._proof.life.heave_m_s() if self._behind_ns <= _BEHIND_NS else 0.0

    def _judge_touch(self, countdown: int) -> bool:
        """Before the first choice: the touch itself shows the gripper's stiffness, or a lift has to.

        Returns:
            Whether to press on here, for the touch was too short to judge it.
        """
        proof, state = self._proof, self._equipment.state
        proof.watch_touch(state.snapshot, self._equipment.measurement)
        if self._longer_ticks > 1:
            self._longer_ticks -= 1
            return True
        if countdown > 1:
            return False
        share = proof.touch.share
        if share is not None and LOWEST_SHARE <= share <= HIGHEST_SHARE:
            state.event("proof", f"first touch: {share:.2f} of the gripper's stiffness")
        elif share is not None and _DOUBTED_SHARE <= share < LOWEST_SHARE and not self._longer_ticks:
            self._longer_ticks = _LONGER_TICKS
            return True
        else:
            proof.life.demand_check()
        self._touch_judged = True
        return False
