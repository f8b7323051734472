"""Proofs of contact while the peg sinks: a wall has to answer, and a peg that rests on something is lifted."""

from math import inf
from typing import Final

from palpate.core.ports import CONTROL_RATE_HZ, STILL, Vector3
from palpate.core.tasks.contact import PAST_PLATE_M, ContactProof, LiftCheck, Mean
from palpate.core.tasks.insertion.phases import Equipment
from palpate.core.trial import N_PER_KGF, Outcome

_WALL_M: Final = 5e-4
"""Depth at which a wall is looked for; half the insertion depth where that is less."""
_UNPROVED_M: Final = 1.5e-3
"""The tip goes so much deeper, and no further, before a wall has answered and the plate's force has gone."""
_FREE_SAMPLES: Final = 3
"""So many samples in a row without contact show that the plate bears the tool no more."""
_HELD_TICKS: Final = CONTROL_RATE_HZ // 2
"""A tool that is still borne is held so long; its force is compared between the ends of that time."""
_COMPARED_TICKS: Final = 24
_STEADY_N: Final = 0.25
"""A force that changes by more while the tool stands still drifts, or bears a peg that is still sinking."""
_UNSTEADY_ROUNDS: Final = 3
"""A peg that sinks on comes to rest in less than so many times that."""
_LONGEST_TICKS: Final = 10 * CONTROL_RATE_HZ
"""Time for the way down; in it, the deepest hole that can be asked for takes five seconds."""
_RESTING_SHARE: Final = 0.45
"""Share of the pressing force, filtered, from which the peg rests: a lift takes off 0.4 of the pressing force."""
_RESTING_TICKS: Final = CONTROL_RATE_HZ // 10
_BETWEEN_TICKS: Final = CONTROL_RATE_HZ // 2
"""Ticks after a lift before the next one's rest begins to count."""
_LED_BACK_M: Final = 1e-3
"""A peg that meets something on its way down comes up by less: by the gripper's spring, under an impact."""


class SinkingChecks:
    """What is checked on the way down."""

    def __init__(self, equipment: Equipment, proof: ContactProof) -> None:
        self._equipment, self._proof, self._lift = (
            equipment,
            proof,
            LiftCheck(equipment.state, equipment.measurement, equipment.motion, proof),
        )
        self._press_N, self._contact_N = equipment.task.press_kgf * N_PER_KGF, equipment.task.contact_kgf * N_PER_KGF
        self._wall_depth_m = min(_WALL_M, 0.5 * equipment.task.insertion_depth_mm * 1e-3)

    def enter(self) -> None:
        """The insertion begins here."""
        self._lift.running, self._rest_ticks = False, 0
        self._deepest_m = -inf
        self._freed, self._free_samples, self._unsteady = False, 0, 0
        self._entered_tick = self._equipment.state.tick
        self._stand_still()
        self._proof.wall.begin(self._equipment.motion.reference_m)

    def step(self, depth_m: float) -> Vector3 | None:
        """Velocity of the tip while a check is made, (3,) m/s, task frame; None when there is nothing to check."""
        if self._equipment.state.tick - self._entered_tick > _LONGEST_TICKS:
            time_s = _LONGEST_TICKS / CONTROL_RATE_HZ
            self._equipment.state.end(Outcome.WEDGED, f"at {depth_m * 1e3:.2f} mm, after {time_s:g} s")
            return STILL
        self.watch_way()
        if self._proof.new and not self._freed and self._rest_ticks >= 0 and not self._lift.running:
            free = self._equipment.measurement.force_N[2] > -self._contact_N
            self._free_samples = self._free_samples + 1 if free else 0
            self._freed = self._free_samples >= _FREE_SAMPLES
        check = self._check_at_rest()
        if check is None and not self._proof.wall.answered and depth_m > self._wall_depth_m:
            return self._push_aside(depth_m)
        if check is None and not self._freed and self._at_bound(depth_m):
            return self._hold(depth_m)
        return check

    def watch_way(self) -> None:
        """A peg that is in the hole does not come out of it by itself."""
        depth_m, state = self._equipment.motion.reference_m[2], self._equipment.state
        self._deepest_m = max(self._deepest_m, depth_m)
        if self._deepest_m - depth_m > _LED_BACK_M:
            state.doubt(self._proof.led_back(state.tick))

    def bounded(self, velocity_m_s: Vector3) -> Vector3:
        """The velocity, without its part across the tool axis once the tip is as far out as a wall can be."""
        return self._proof.wall.bounded(velocity_m_s, self._equipment.motion.reference_m)

    def _check_at_rest(self) -> Vector3 | None:
        """A peg that rests on something on its way down has met a wall or the plate, or its sensor is held."""
        resting = self._equipment.measurement.filtered_force_z_N < -_RESTING_SHARE * self._press_N
        self._rest_ticks = self._rest_ticks + 1 if resting else min(self._rest_ticks, 0)
        if not self._lift.running:
            if self._rest_ticks < _RESTING_TICKS:
                return None
            self._lift.begin()
        along = self._lift.velocity_m_s()
        if along is None:
            self._rest_ticks = -_BETWEEN_TICKS
        return 0.0, 0.0, along or 0.0

    def _push_aside(self, depth_m: float) -> Vector3:
        """Sink on, but not far, while a wall is looked for."""
        equipment, proof, state = self._equipment, self._proof, self._equipment.state
        reference_m, force_N = equipment.motion.reference_m, equipment.measurement.force_N
        across = proof.wall.velocity_m_s(force_N, proof.new, reference_m)
        if proof.wall.answered:
            state.event("proof", f"wall: {proof.wall.answer_N:.2f} N at {depth_m * 1e3:.2f} mm")
        elif proof.wall.failed:
            unseen, limit_m = state.slack_m > 0.0, state.slack_m + PAST_PLATE_M
            state.doubt(proof.no_plate(state.tick, depth_m, limit_m) if unseen else proof.no_wall(state.tick, depth_m))
        along = equipment.laws.inserting.velocity_m_s(reference_m, reference_m, force_N)[2]
        return *across, min(along, 0.0) if self._at_bound(depth_m) else along

    def _hold(self, depth_m: float) -> Vector3:
        """A peg that sinks though it is borne hangs on a wall, or its sensor drifts: at rest the force shows which."""
        equipment, state, force_N = self._equipment, self._equipment.state, self._equipment.measurement.force_N
        self._held_ticks += 1
        if self._held_ticks <= _COMPARED_TICKS:
            self._early.add(force_N[2], self._proof.new)
        elif self._held_ticks > _HELD_TICKS - _COMPARED_TICKS:
            self._late.add(force_N[2], self._proof.new)
        if self._held_ticks == _HELD_TICKS:
            change_N = self._late.value - self._early.value
            if abs(change_N) > _STEADY_N:
                self._unsteady += 1
                if self._unsteady == _UNSTEADY_ROUNDS:
                    state.doubt(self._proof.drifts(state.tick, depth_m, change_N, _STEADY_N))
            elif self._late.value > -_RESTING_SHARE * self._press_N:
                self._freed = True
            self._stand_still()
        reference_m = equipment.motion.reference_m
        x, y, z = self.bounded(equipment.laws.inserting.velocity_m_s(reference_m, reference_m, force_N))
        return x, y, min(z, 0.0)

    def _stand_still(self) -> None:
        self._held_ticks, self._early, self._late = 0, Mean(), Mean()

    def _at_bound(self, depth_m: float) -> bool:
        return depth_m > _WALL_M + self._equipment.state.slack_m + _UNPROVED_M
