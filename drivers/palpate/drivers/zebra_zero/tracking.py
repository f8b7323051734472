"""The newest value of every axis, which values to believe, and the velocity between cycles."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Final

from palpate.drivers.nmc.frames import Aux, Status
from palpate.drivers.nmc.replies import Reply
from palpate.drivers.zebra_zero.counts import JOINTS, Six, SixCounts, six
from palpate.drivers.zebra_zero.measured import Measured
from palpate.drivers.zebra_zero.settings import Applied, ZebraZeroSettings

_STILL: Final = six((0.0,) * JOINTS)
_RATE_WINDOW: Final = 281


class Tracking:
    """Takes replies and keeps what is believed of them.

    A reply of another axis, or a damaged one that has the right sum, shows as a jump that no motor can make: more than
    twice what the highest velocity allows, plus the position error at which the firmware gives up.

    Args:
        settings: The arm's settings.
    """

    def __init__(self, settings: ZebraZeroSettings) -> None:
        self._transmission = settings.transmission
        self._stored_tolerance_counts = settings.stored_tolerance_counts
        self._slack_counts = settings.gains.error_limit_counts
        rates = settings.transmission.motor_rates((settings.limits.velocity_rad_per_s,) * JOINTS)
        self._jump_counts_per_s = tuple(2.0 * rate for rate in rates)
        self._counts = [0] * JOINTS
        self._time_ns: list[int | None] = [None] * JOINTS
        self._status = [Status(0)] * JOINTS
        self._aux: list[Aux | None] = [None] * JOINTS
        self._complete: tuple[int, Six] | None = None
        self._velocity: Six = _STILL
        self._doubts = [0] * JOINTS
        self._begins_ns: deque[int] = deque(maxlen=_RATE_WINDOW)

    @property
    def counts(self) -> SixCounts:
        """Newest counter values."""
        a, b, c, d, e, f = self._counts
        return a, b, c, d, e, f

    @property
    def position_rad(self) -> Six:
        """Newest joint angles."""
        return self._transmission.to_rad(self._counts)

    @property
    def rate_Hz(self) -> float | None:
        """Rate of the newest cycles; None before the second."""
        begins = self._begins_ns
        span_ns = begins[-1] - begins[0] if len(begins) > 1 else 0
        return (len(begins) - 1) * 1e9 / span_ns if span_ns else None

    def agrees(self, stored_counts: Sequence[int]) -> bool:
        """Whether the counters are where an earlier run has left them."""
        if len(stored_counts) != JOINTS:
            return False
        pairs = zip(self._counts, stored_counts, strict=True)
        return all(abs(a - b) <= self._stored_tolerance_counts for a, b in pairs)

    def begin_at(self, counts: SixCounts) -> None:
        """Forgets what was and begins at these counts, of which the time is unknown."""
        self._counts = list(counts)
        self._time_ns = [None] * JOINTS
        self._complete, self._velocity = None, _STILL
        self._doubts = [0] * JOINTS

    def take(self, axis: int, reply: Reply, now_ns: int, *, is_driven: bool) -> int:
        """Keeps a reply unless its position is impossible.

        Args:
            axis: Motor, 1 to 6.
            reply: Its reply.
            now_ns: When it arrived.
            is_driven: The servo is on; a motor that is off may be moved by hand at any speed.

        Returns:
            0 when it is believed, else how many in a row of this axis were not.
        """
        index, counts = axis - 1, reply.position_counts
        if counts is None:
            return self._doubt(index)
        last_ns = self._time_ns[index]
        if is_driven and last_ns is not None:
            allowed = self._slack_counts + self._jump_counts_per_s[index] * (now_ns - last_ns) * 1e-9
            if abs(counts - self._counts[index]) > allowed:
                return self._doubt(index)
        self._counts[index], self._time_ns[index] = counts, now_ns
        self._status[index], self._aux[index] = reply.status, reply.aux
        self._doubts[index] = 0
        return 0

    def measured(self, is_fresh: tuple[bool, ...], applied: Applied | None, begin_ns: int, end_ns: int) -> Measured:
        """Ends a cycle: the velocity since the last complete one, and all there is to tell.

        The NMC velocity word is not used: CALC, without fraction it has steps of 0.064 rad/s on joint 1.

        Args:
            is_fresh: Which axes were taken in this cycle.
            applied: What became of the set-point.
            begin_ns: Before the first exchange.
            end_ns: After the last.
        """
        self._begins_ns.append(begin_ns)
        position, time_ns = self.position_rad, (begin_ns + end_ns) // 2
        if all(is_fresh):
            if self._complete is not None and time_ns > self._complete[0]:
                elapsed_s, last = (time_ns - self._complete[0]) * 1e-9, self._complete[1]
                self._velocity = six([(q - p) / elapsed_s for q, p in zip(position, last, strict=True)])
            self._complete = time_ns, position
        return Measured(
            position_rad=position,
            velocity_rad_per_s=self._velocity,
            counts=self.counts,
            status=tuple(self._status),
            aux=tuple(self._aux),
            is_fresh=is_fresh,
            applied=applied,
            begin_ns=begin_ns,
            end_ns=end_ns,
        )

    def _doubt(self, index: int) -> int:
        self._doubts[index] += 1
        return self._doubts[index]


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
