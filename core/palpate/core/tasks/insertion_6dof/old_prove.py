"""The last proof: the floor of the hole bears a lift, or where there is none, the force follows pushes to and fro."""

from typing import Final

from typing_extensions import override

from palpate.core.ports import CONTROL_RATE_HZ, STILL, Vector3
from palpate.core.tasks.contact import BothWallsCheck, ContactProof, LiftCheck, Mean, RunningPhase
from palpate.core.tasks.insertion.phases import Equipment
from palpate.core.trial import N_PER_KGF

_PAST_FLOOR_M: Final = 3e-4
"""A tip so far below where the floor must be has none under it."""
_SEATED_SHARE: Final = 0.7
"""Share of the pressing force, filtered, from which the floor is pressed enough for the lift."""
_SEATING_TICKS: Final = CONTROL_RATE_HZ // 2
"""Time for that; friction on the walls may keep it from being reached."""


class Prove(RunningPhase):
    """Holds what the sensor shows at full depth against what the hole gives there; the trial ends in it."""

    def __init__(self, equipment: Equipment, proof: ContactProof) -> None:
        task = equipment.task
        self._equipment, self._proof, self._lift = (
            equipment,
            proof,
            LiftCheck(equipment.state, equipment.measurement, equipment.motion, proof),
        )
        self._walls = BothWallsCheck(task.reach_m)
        self._contact_N, self._press_N = task.contact_kgf * N_PER_KGF, task.press_kgf * N_PER_KGF
        self._shallowest_m = (task.insertion_depth_mm - task.depth_tolerance_mm) * 1e-3
        self._deepest_m = (task.insertion_depth_mm + task.depth_tolerance_mm) * 1e-3

    def enter(self) -> None:
        """The tip is as deep as it shall be."""
        self.over, self._lift.running = False, False
        # Where the plate was never touched, only the floor can show that the force along the axis is alive. The filter
        # still shows the plate to a peg that sinks on where ticks are late: that one may find no floor.
        measured, state = self._equipment.measurement, self._equipment.state
        self._floor_due = (
            max(measured.filtered_force_z_N, measured.force_N[2]) < -self._contact_N or state.slack_m > 0.0
        )
        self._floor, self._countdown = self._floor_due or self._depth_m() < self._deepest_m, _SEATING_TICKS
        # One reach for all pushes of a trial: what a wall that was none took of it is not to be had again.
        self._walls.begin(self._proof.wall.from_m)
        self._depth = Mean()

    @override
    def step(self) -> Vector3:
        """Press on the floor, then lift; or push to and fro."""
        depth_m = self._depth_m()
        if self._floor and not self._floor_due and depth_m > self._deepest_m + _PAST_FLOOR_M:
            self._floor = False
        return self._try_floor(depth_m) if self._floor else self._try_walls(depth_m)

    def _depth_m(self) -> float:
        return self._equipment.measurement.tip_depth_m - self._equipment.state.surface_m

    def _try_walls(self, depth_m: float) -> Vector3:
        equipment, proof, state, walls = self._equipment, self._proof, self._equipment.state, self._walls
        measured = equipment.measurement
        across = walls.velocity_m_s(measured.force_N, proof.new, equipment.motion.reference_m, measured.position_m)
        self._depth.add(depth_m, proof.new)
        if walls.failed:
            state.doubt(proof.no_walls(state.tick, depth_m, walls.forces_N))
        elif walls.answered and self._depth.value < self._shallowest_m:
            state.doubt(proof.no_depth(state.tick, self._depth.value, self._shallowest_m))
        elif walls.answered:
            told = ", ".join(f"{force_N:.2f}" for force_N in walls.forces_N)
            state.event("proof", f"walls: {told} N at {self._depth.value * 1e3:.2f} mm")
            state.end_inserted(self._depth.value)
        return *across, 0.0

    def _try_floor(self, depth_m: float) -> Vector3:
        proof, state = self._proof, self._equipment.state
        if not self._lift.running:
            self._countdown -= 1
            deepest_m = self._deepest_m + state.slack_m + _PAST_FLOOR_M
            pressed_N, needed_N = -self._equipment.measurement.filtered_force_z_N, _SEATED_SHARE * self._press_N
            if depth_m > deepest_m:
                state.doubt(proof.no_floor(state.tick, depth_m, deepest_m))
            elif self._countdown <= 0:
                state.doubt(proof.floor_too_soft(state.tick, pressed_N, needed_N))
            elif pressed_N < needed_N:
                return self._press_on()
            self._lift.begin()
        along = self._lift.velocity_m_s()
        if along is None and proof.axial.passed:
            floor_m = proof.axial.tip_depth_m - state.surface_m
            if floor_m < 0.0:
                # Led back out by a force that was not there, it passed by chance. Less deep than asked for it may be.
                state.doubt(proof.no_depth(state.tick, floor_m, self._shallowest_m))
                return STILL
            state.event("proof", f"floor: {proof.axial.share:.2f} of the gripper's stiffness")
            state.end_inserted(floor_m)
        return 0.0, 0.0, along or 0.0

    def _press_on(self) -> Vector3:
        equipment, reference_m = self._equipment, self._equipment.motion.reference_m
        velocity = equipment.laws.inserting.velocity_m_s(reference_m, reference_m, equipment.measurement.force_N)
        return self._walls.first.bounded(velocity, reference_m)
