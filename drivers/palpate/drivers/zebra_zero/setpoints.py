"""The stream of set-points: where it stands, how fast it goes, and what the limits make of the next one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from palpate.drivers.zebra_zero.counts import JOINTS, Six, six
from palpate.drivers.zebra_zero.limits import Applied
from palpate.drivers.zebra_zero.settings import ZebraZeroSettings

_STILL: Final = six((0.0,) * JOINTS)


class Setpoints:
    """Set-points of one stretch with the servos on.

    Args:
        settings: The arm's settings.
    """

    def __init__(self, settings: ZebraZeroSettings) -> None:
        self._limits = settings.limits
        self._period_s = 1.0 / settings.rate_Hz
        self._position, self._velocity, self._time_ns = _STILL, _STILL, 0

    def begin_at(self, position_rad: Six, now_ns: int) -> None:
        """Begins where the servos hold the arm; the first step may take a whole period."""
        self._position, self._velocity = position_rad, _STILL
        self._time_ns = now_ns - round(self._period_s * 1e9)

    def hold(self) -> None:
        """A cycle without a set-point: the next one starts from rest."""
        self._velocity = _STILL

    def preview(self, asked_rad: Sequence[float]) -> Applied:
        """What would be applied a whole period after the last set-point; changes nothing.

        Raises:
            RefusedError: There are not six finite angles.
        """
        return self._limits.applied(asked_rad, self._position, self._velocity, self._period_s)

    def advance(self, asked_rad: Sequence[float], now_ns: int) -> Applied:
        """What is applied now; no more than a period counts, so that a late cycle gets no longer step.

        Raises:
            RefusedError: There are not six finite angles.
        """
        step_s = min((now_ns - self._time_ns) * 1e-9, self._period_s)
        applied = self._limits.applied(asked_rad, self._position, self._velocity, step_s)
        if step_s > 0.0:
            moves = zip(applied.position_rad, self._position, strict=True)
            self._velocity = six([(q - p) / step_s for q, p in moves])
            self._position, self._time_ns = applied.position_rad, now_ns
        return applied
