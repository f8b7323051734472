"""The insertion: down the hole, with the lateral force regulated away, to the depth that is asked for."""

from typing import Final

from typing_extensions import override

from palpate.core.ports import CONTROL_RATE_HZ, Vector3
from palpate.core.tasks.contact import RunningPhase
from palpate.core.tasks.insertion.phases import Equipment
from palpate.core.tasks.insertion_6dof.old_explore import DROP_M
from palpate.core.tasks.insertion_6dof.old_sinking_checks import SinkingChecks
from palpate.core.trial import N_PER_KGF, Outcome

_STALL_TICKS: Final = CONTROL_RATE_HZ // 2
"""Insertion that gains no depth for so long has met something."""
_STALL_M: Final = 1e-4
_JAM_TICKS: Final = 3 * CONTROL_RATE_HZ


class Insert(RunningPhase):
    """Sinks until the peg is deep enough, has met an edge, or jams.

    Args:
        checks: Prove contact on the way; None for a task without proofs.

    Attributes:
        depth_m: Depth of the tip below the surface in the last tick.
        deep: Whether that is as deep as it shall be; where it is not, and the phase is over, the drop was no hole.
    """

    def __init__(self, equipment: Equipment, checks: SinkingChecks | None) -> None:
        task = equipment.task
        self._state, self._measurement, self._motion = equipment.state, equipment.measurement, equipment.motion
        self._law, self._checks = equipment.laws.inserting, checks
        self._contact_N, self._full_depth_m = task.contact_kgf * N_PER_KGF, task.insertion_depth_mm * 1e-3
        self._tolerance_m = task.depth_tolerance_mm * 1e-3

    def enter(self) -> None:
        """The reaction of the plate is lost here."""
        self.over = self.deep = False
        self._state.hole_tick = self._last_progress = self._state.tick
        self._best_depth_m, self._checking = 0.0, False
        self._law.reset()
        if self._checks is not None:
            self._checks.enter()

    def _stuck(self) -> None:
        """Nothing was gained for long, below where a drop may have been none."""
        self._state.end(Outcome.WEDGED, f"at {self.depth_m * 1e3:.2f} mm")

    @override
    def step(self) -> Vector3:
        state, measured = self._state, self._measurement
        self.depth_m = depth = measured.tip_depth_m - state.surface_m
        if depth > self._best_depth_m + _STALL_M:
            self._best_depth_m, self._last_progress = depth, state.tick
        stalled = state.tick - self._last_progress
        if self._checks is not None:
            check = self._checks.step(depth)
            self._checking = check is not None
            if check is not None:
                return check
        velocity = self._law.velocity_m_s(self._motion.reference_m, self._motion.reference_m, measured.force_N)
        if depth >= self._full_depth_m + self._tolerance_m or (
            depth >= self._full_depth_m - self._tolerance_m - state.slack_m - state.edge_m
            and measured.filtered_force_z_N < -self._contact_N
        ):
            state.event("hole", f"found after {state.exploration_s:.3f} s")
            self.over = self.deep = True
        elif stalled > _STALL_TICKS and depth < DROP_M:
            state.event("false drop", f"to {self._best_depth_m * 1e3:.3f} mm")
            state.hole_tick = None
            self.over = True
        elif stalled > _JAM_TICKS:
            self._stuck()
        return velocity if self._checks is None else self._checks.bounded(velocity)
