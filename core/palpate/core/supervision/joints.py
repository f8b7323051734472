"""Does the arm do what it is told, and no more?"""

from __future__ import annotations

from collections import deque
from operator import le, sub
from typing import Final

from palpate.core.supervision.values import Trip, TripReason
from palpate.core.supervision_config import SupervisionConfig
from palpate.core.values import JointVector, Snapshot

_WINDOW_NS: Final = 25_000_000
"""Velocities are differences over at least so long: a step of the encoder then weighs little."""


class JointWatch:
    """Measured joint angles against the arm's limits and against the commands.

    Args:
        config: The limits.
        lower_rad: Lower joint limits of the arm, (n,).
        upper_rad: Upper joint limits, (n,).
        velocity_limit_rad_s: Joint velocity limits, (n,).
    """

    def __init__(
        self,
        config: SupervisionConfig,
        lower_rad: JointVector,
        upper_rad: JointVector,
        velocity_limit_rad_s: JointVector,
    ) -> None:
        slack = config.joint_slack_mrad * 1e-3
        self._lower = tuple(q - slack for q in lower_rad)
        self._upper = tuple(q + slack for q in upper_rad)
        self._velocity = tuple(v * config.max_joint_velocity_share for v in velocity_limit_rad_s)
        self._least_velocity_rad_ns = min(self._velocity) * 1e-9
        self._tracking_rad = config.max_tracking_error_mrad * 1e-3
        self._commands: deque[JointVector] = deque(maxlen=config.tracking_lag_ticks + 1)
        self._samples: deque[tuple[int, JointVector]] = deque()
        self._sequence: int | None = None

    def begin(self) -> None:
        """A trial begins."""
        self._commands.clear()
        self._samples.clear()
        self._sequence = None

    def trip(self, snapshot: Snapshot, held_rad: JointVector) -> Trip | None:
        """What is wrong with this tick's joint angles, which are valid; None if nothing is.

        Args:
            snapshot: The tick.
            held_rad: What the arm was told in the tick before, (n,).
        """
        joints = snapshot.joints
        q = joints.position_rad
        if not (all(map(le, self._lower, q)) and all(map(le, q, self._upper))):
            return self._outside(snapshot.tick, q)
        if joints.sequence != self._sequence:
            self._sequence = joints.sequence
            samples, now_ns = self._samples, joints.source_time_ns
            # The same reading under another number says nothing about velocity.
            if not samples or now_ns > samples[-1][0]:
                samples.append((now_ns, q))
                while len(samples) > 1 and now_ns - samples[1][0] >= _WINDOW_NS:
                    samples.popleft()
                then_ns, then = samples[0]
                dt_ns = now_ns - then_ns
                if dt_ns >= _WINDOW_NS and max(map(abs, map(sub, q, then))) > self._least_velocity_rad_ns * dt_ns:
                    trip = self._fast(snapshot.tick, q, then, dt_ns * 1e-9)
                    if trip is not None:
                        return trip
        commands = self._commands
        commands.append(held_rad)
        if max(map(abs, map(sub, q, commands[0]))) <= self._tracking_rad:
            return None
        return self._astray(snapshot.tick, q)

    def _outside(self, tick: int, q: JointVector) -> Trip | None:
        for number, (value, low, high) in enumerate(zip(q, self._lower, self._upper, strict=True), start=1):
            if not low <= value <= high:
                limit = low if value < low else high
                text = f"joint {number} at {value:.4f} rad, limit {limit:.4f} rad"
                return Trip(TripReason.JOINT_POSITION, tick, value, limit, text)
        return None

    def _fast(self, tick: int, q: JointVector, then: JointVector, dt_s: float) -> Trip | None:
        for number, (now, before, limit) in enumerate(zip(q, then, self._velocity, strict=True), start=1):
            velocity = abs(now - before) / dt_s
            if velocity > limit:
                text = f"joint {number} moves at {velocity:.3f} rad/s, limit {limit:.3f} rad/s"
                return Trip(TripReason.JOINT_VELOCITY, tick, velocity, limit, text)
        return None

    def _astray(self, tick: int, q: JointVector) -> Trip | None:
        """An arm that lags is between the commands of the last ticks; beyond them all it does not follow."""
        limit = self._tracking_rad
        for number, (value, commands) in enumerate(zip(q, zip(*self._commands, strict=True), strict=True), start=1):
            error = max(min(commands) - value, value - max(commands))
            if error > limit:
                text = f"joint {number} is {error * 1e3:.2f} mrad from its command, limit {limit * 1e3:g} mrad"
                return Trip(TripReason.TRACKING_ERROR, tick, error * 1e3, limit * 1e3, text)
        return None
