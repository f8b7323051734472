"""The path of a compliant tool down the hole, and back out after a false detection."""

from math import cos, hypot, pi, radians, sin
from typing import Final

from typing_extensions import override

from palpate.core.motion import AngularCompliance
from palpate.core.ports import CONTROL_RATE_HZ, Vector3
from palpate.core.tasks.contact import Monitor
from palpate.core.tasks.insertion.phases import Equipment, Insert, Stage
from palpate.core.tasks.insertion_6dof.options import SpatialOptions
from palpate.core.trial import N_PER_KGF, ControlConfig

_FASTEST_RAD_S: Final = radians(6.0)
_SEATED_NM: Final = 0.008
_SEATED_SHARE: Final = 0.6
_STUCK_TICKS: Final = 2 * CONTROL_RATE_HZ
_SEATING_TICKS: Final = CONTROL_RATE_HZ
"""Longest time for a tilted peg on an edge of the floor to comply until it is flat."""
_CIRCLE_TICKS: Final = CONTROL_RATE_HZ // 2
"""Number of ticks per turn of a wobble, and number of ticks without progress before it begins."""
TILTED_RAD: Final = 0.03
"""Maximum tilt for an inserted peg (26 mrad in trials without a fault); withdrawing a peg with more tilt bends the
gripper."""
_SUNK_M: Final = 1e-4
"""Distance that a wobbling peg must sink to show that the walls were holding it."""


class SpatialInsert(Insert):
    """Phase that lowers the peg and complies with all torques; if the peg sticks, the trial resumes exploration.

    Args:
        options: Options for the tool's compliance.
    """

    def __init__(self, equipment: Equipment, monitor: Monitor, control: ControlConfig, options: SpatialOptions) -> None:
        super().__init__(equipment, monitor, control)
        self._seated_N = _SEATED_SHARE * equipment.task.press_kgf * N_PER_KGF
        self._giving = AngularCompliance(
            options.insert_tilt_rad_per_Nms, options.insert_yaw_rad_per_Nms, _FASTEST_RAD_S
        )
        self._wobble_rad_s = radians(options.wobble_deg_s)
        # Tight-fitting pegs stay in contact as they go in; the search raises the tool, and drift then shows in the air.
        self._zero.drop_m = 0.0

    @override
    def enter(self) -> None:
        super().enter()
        self._flat_ticks, self._flat_from_m = 0, 0.0

    @override
    def step(self) -> Vector3:
        velocity = super().step()
        stalled = self._state.tick - self._progress_tick
        tilted = hypot(*self._motion.turn_rad[:2]) > TILTED_RAD
        if self._state.report.outcome is None and not self.over and not self._found:
            if stalled > _STUCK_TICKS or tilted:
                self._wedged(f"at {self._depth_m * 1e3:.2f} mm")
        if self._stage not in (Stage.LOOK, Stage.RELEASE, Stage.LET_GO):
            self._comply(wobble=self._flat_ticks > 0 or self._stage is Stage.SEAT or stalled > _CIRCLE_TICKS)
        return velocity

    def _comply(self, *, wobble: bool) -> None:
        x, y, yaw = self._giving.rate_rad_s(self._measurement.live_torque_at_tip_Nm())
        if wobble and self._flat_ticks <= _CIRCLE_TICKS:
            # Friction on both sides of a wedge hides the direction of the tilt: try all directions.
            turned = 2.0 * pi * self._state.tick / _CIRCLE_TICKS
            x, y = x + self._wobble_rad_s * cos(turned), y + self._wobble_rad_s * sin(turned)
        self._motion.turn((x, y, yaw))

    def _begin_look(self) -> None:
        """Before checking a possible floor, wobble and comply on it until the peg is flat."""
        measured, past = self._measurement, self._depth_m - self._state.slack_m > self._full_m + self._tolerance_m
        if self._flat_ticks == 0 or self._depth_m > self._flat_from_m + _SUNK_M:
            # A wedge is detected if the peg sinks further.
            self._flat_from_m, self._flat_ticks = self._depth_m, 0
        self._flat_ticks += 1
        tx, ty, _ = measured.filtered_wrench_at_tip()[1]
        seated = hypot(tx, ty) < _SEATED_NM and measured.filtered_force_z_N < -self._seated_N
        wobbled = self._flat_ticks - _CIRCLE_TICKS
        if self._found or past or (wobbled > 0 and seated) or wobbled > _SEATING_TICKS:
            super()._begin_look()

    def _wedged(self, text: str) -> None:
        if self._state.claimed:
            super()._wedged(text)
            return
        self._state.event("stuck", text)
        self._state.hole_tick = None
        self.over = True
