"""The way down the hole of a tool that gives way, and back out where the hole was none."""

from math import cos, hypot, pi, radians, sin
from typing import Final

from typing_extensions import override

from palpate.core.motion import GivingWay
from palpate.core.ports import CONTROL_RATE_HZ, Vector3
from palpate.core.tasks.insertion.phases import Equipment
from palpate.core.tasks.insertion_6dof.old_insert import Insert
from palpate.core.tasks.insertion_6dof.old_sinking_checks import SinkingChecks
from palpate.core.tasks.insertion_6dof.options import SpatialOptions
from palpate.core.trial import N_PER_KGF

_FASTEST_RAD_S: Final = radians(6.0)
_SEATED_NM: Final = 0.008
_SEATED_SHARE: Final = 0.6
_STUCK_TICKS: Final = 2 * CONTROL_RATE_HZ
_SEATING_TICKS: Final = CONTROL_RATE_HZ
"""A peg that leans stands on an edge of the floor; so long, at most, it gives way until it stands flat."""
_CIRCLE_TICKS: Final = CONTROL_RATE_HZ // 2
"""Time of one turn of a wobble, and after which it begins where nothing is gained. Half of it gave the same."""
LEANT_RAD: Final = 0.03
"""A peg that is let in leans no further, 26 mrad in trials without a fault; drawn back while it does, it bends the
gripper."""
_SUNK_M: Final = 1e-4
"""A peg that sinks by more while it wobbles hung on the walls."""


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
        self._wobble_rad_s = radians(options.wobble_deg_s)

    @override
    def enter(self) -> None:
        super().enter()
        self._seating = 0

    @override
    def step(self) -> Vector3:
        if self._seating:
            velocity = self._seat()
            wobbles = self._seating <= _CIRCLE_TICKS
        else:
            velocity = super().step()
            stalled = self._state.tick - self._last_progress
            if self.deep:
                self.over, self._seating = False, 1
            elif self._state.report.outcome is None and (
                stalled > _STUCK_TICKS or hypot(*self._motion.turn_rad[:2]) > LEANT_RAD
            ):
                self._stuck()
            if self._checking:
                # Force is held against position: at rest.
                return velocity
            wobbles = stalled > _CIRCLE_TICKS
        x, y, yaw = self._giving.rate_rad_s(self._measurement.live_torque_at_tip_Nm())
        if wobbles:
            # Friction on both sides of a wedge hides which way it leans: all ways are tried.
            turned = 2.0 * pi * self._state.tick / _CIRCLE_TICKS
            x, y = x + self._wobble_rad_s * cos(turned), y + self._wobble_rad_s * sin(turned)
        self._motion.turn((x, y, yaw))
        return velocity

    def _seat(self) -> Vector3:
        """On what may be the floor: where it is a wedge, the peg sinks as it wobbles; then until it stands flat."""
        measured, reference_m = self._measurement, self._motion.reference_m
        self._seating += 1
        tx, ty, _ = measured.filtered_wrench_at_tip()[1]
        seated = hypot(tx, ty) < _SEATED_NM and measured.filtered_force_z_N < -self._seated_N
        depth_m = measured.tip_depth_m - self._state.surface_m
        if depth_m > self._best_depth_m + _SUNK_M:
            self._best_depth_m, self._seating = depth_m, 1
        # Past the floor there is none, or a sensor that does not show it: what follows proves which.
        past = depth_m - self._state.slack_m > self._full_depth_m + self._tolerance_m
        if self._checks is not None:
            self._checks.watch_way()
        # What leans it further is not the floor's either.
        leant = hypot(*self._motion.turn_rad[:2]) > LEANT_RAD
        wobbled = self._seating - _CIRCLE_TICKS
        self.over = past or leant or (wobbled > 0 and seated) or wobbled > _SEATING_TICKS
        velocity = self._law.velocity_m_s(reference_m, reference_m, measured.force_N)
        return velocity if self._checks is None else self._checks.bounded(velocity)

    @override
    def _stuck(self) -> None:
        self._state.event("stuck", f"at {self.depth_m * 1e3:.2f} mm")
        self._state.hole_tick = None
        self.over = True
