"""From joint angles to what the drives want to hear: counts in CSP, counts/s in CSV."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.drivers.cia402.profile import Mode
from palpate.drivers.cia402.settings import ArmSettings, JointDrive
from palpate.drivers.cia402.watch import AxisView


class Targets:
    """Targets for the next SYNC.

    In CSV the position loop is here: the velocity removes a share of the error that will be left when it takes
    effect, one period after the newest measurement. A joint that did not answer gets velocity 0, since nobody
    knows where it is going.

    Args:
        settings: The arm.

    Attributes:
        newest: What was computed last.
    """

    def __init__(self, settings: ArmSettings) -> None:
        self._settings = settings
        self.newest: tuple[int, ...] = (0,) * len(settings.joints)

    def hold(self, views: Sequence[AxisView]) -> tuple[int, ...]:
        """Targets that move nothing: where each joint is, or velocity 0."""
        if self._settings.mode is Mode.CSP and views:
            self.newest = tuple(view.counts or 0 for view in views)
        else:
            self.newest = (0,) * len(self._settings.joints)
        return self.newest

    def follow(self, reference_rad: Sequence[float], views: Sequence[AxisView]) -> tuple[int, ...]:
        """Targets that lead each joint to its reference."""
        joints = self._settings.joints
        if self._settings.mode is Mode.CSP:
            self.newest = tuple(joint.counts(angle) for joint, angle in zip(joints, reference_rad, strict=True))
        else:
            axes = zip(joints, reference_rad, views, self.newest, strict=True)
            self.newest = tuple(self._velocity(*axis) for axis in axes)
        return self.newest

    def _velocity(self, joint: JointDrive, reference_rad: float, view: AxisView, present: int) -> int:
        if view.counts is None or view.missed_in_a_row > 0:
            return 0
        period_s = self._settings.period_s
        error_counts = joint.counts(reference_rad) - view.counts - present * period_s
        most = abs(joint.velocity_rad_per_s * joint.counts_per_rad)
        return round(min(max(self._settings.csv_gain * error_counts / period_s, -most), most))
