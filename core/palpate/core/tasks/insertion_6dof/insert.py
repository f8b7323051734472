"""The way down the hole of a tool that gives way, and back out where the hole was none."""

from __future__ import annotations

from math import hypot, radians
from typing import Final

from typing_extensions import override

from palpate.core.motion import GivingWay
from palpate.core.ports import CONTROL_RATE_HZ, Vector3
from palpate.core.tasks.insertion.phases import Equipment, Insert, SinkingChecks
from palpate.core.tasks.insertion_6dof.options import SpatialOptions
from palpate.core.trial import N_PER_KGF

_FASTEST_RAD_S: Final = radians(6.0)
_SEATED_NM: Final = 0.008
_TILTED_RAD: Final = radians(2.5)
"""A tool that has given way so far is not in a hole but beside it."""
_SEATED_SHARE: Final = 0.6
_STUCK_TICKS: Final = 2 * CONTROL_RATE_HZ
_SEATING_TICKS: Final = CONTROL_RATE_HZ
"""A peg that leans stands on an edge of the floor; so long, at most, it gives way until it stands flat."""


class SpatialInsert(Insert):
    """Sinks and gives way to all torque; where it gets stuck, exploration goes on instead of a jam.

    Args:
        equipment: What the phases share.
        checks: Prove contact on the way; None for a task without proofs.
        options: How the tool gives way.
    """

    def __init__(self, equipment: Equipment, checks: SinkingChecks | None, options: SpatialOptions) -> None:
        super().__init__(equipment, checks)
        self._seated_N = _SEATED_SHARE * equipment.task.press_kgf * N_PER_KGF
        self._giving = GivingWay(options.insert_tilt_rad_per_Nms, options.insert_yaw_rad_per_Nms, _FASTEST_RAD_S)

    @override
    def enter(self) -> None:
        super().enter()
        self._seating = 0

    @override
    def step(self) -> Vector3:
        measured, reference_m = self._measurement, self._motion.reference_m
        if self._seating:
            self._seating += 1
            tx, ty, _ = measured.filtered_wrench_at_tip()[1]
            seated = hypot(tx, ty) < _SEATED_NM and measured.filtered_force_z_N < -self._seated_N
            # Past the floor there is none, or a sensor that does not show it: what follows proves which.
            depth_m = measured.tip_depth_m(self._axial_N_per_m) - self._state.surface_m - self._state.slack_m
            past = depth_m > self._full_depth_m + self._tolerance_m
            self.over = seated or past or self._seating > _SEATING_TICKS
            velocity = self._law.velocity_m_s(reference_m, reference_m, measured.force_N)
            velocity = velocity if self._checks is None else self._checks.bounded(velocity)
        else:
            velocity = super().step()
            if self.deep:
                self.over, self._seating = False, 1
            elif self._state.report.outcome is None and (
                self._state.tick - self._last_progress > _STUCK_TICKS or hypot(*self._motion.turn_rad[:2]) > _TILTED_RAD
            ):
                self._stuck()
            if self._checking:
                # Force is held against position: at rest.
                return velocity
        self._motion.turn(self._giving.rate_rad_s(measured.live_torque_at_tip_Nm()))
        return velocity

    @override
    def _stuck(self) -> None:
        self._state.event("stuck", f"at {self.depth_m * 1e3:.2f} mm")
        self._state.hole_tick = None
        self.over = True
