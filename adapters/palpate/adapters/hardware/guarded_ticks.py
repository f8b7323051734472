"""Slow motion, commanded tick by tick, that stops at the first irregularity."""

from collections.abc import Callable
from math import dist
from typing import Final

from palpate.core.control_loop import next_slot, tick_time_ns
from palpate.core.errors import DeviceError
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    CommandReason,
    JointCommand,
    JointVector,
    Ports,
    Snapshot,
    Validity,
    Vector3,
)
from palpate.core.supervision import SampleMonitor, require_raw

_BLIND_TICKS: Final = CONTROL_RATE_HZ // 4
"""Time that the arm waits in place for new samples, because samples may be stale after a pause."""
_TICK_NS: Final = 1_000_000_000 // CONTROL_RATE_HZ


class GuardedTicks:
    """Control ticks for an arm that moves only while its samples are valid and the force stays near a reference.

    Args:
        monitor: Monitor that checks the samples as in a run.
        limit_N: Maximum deviation from the force at the last :meth:`mark`.
        motion: Name of the motion, for use in error messages.
        stopped_by: Function that returns the cause of a stop; empty if unknown.
    """

    def __init__(
        self, ports: Ports, monitor: SampleMonitor, limit_N: float, motion: str, stopped_by: Callable[[], str]
    ) -> None:
        self._ports, self._monitor, self._limit_N = ports, monitor, limit_N
        self._motion, self._stopped_by = motion, stopped_by
        self._start_ns, self._slot = ports.clock.now_ns(), 0
        self._held: JointVector = ()
        monitor.begin()
        self.mark()

    def mark(self) -> None:
        """Use the current force as the new reference."""
        self._first_N = recent_force_N(self._ports)

    def tick(self, q_rad: JointVector) -> Snapshot:
        """Command joint angles, (n,), and return the samples; the arm holds its pose until the samples are valid.

        Raises:
            DeviceError: The samples stay invalid, the force deviates too much, or the arm is held back.
        """
        clock, ports = self._ports.clock, self._ports
        for _ in range(_BLIND_TICKS + 1):
            clock.sleep_until(tick_time_ns(self._start_ns, self._slot))
            now_ns = clock.now_ns()
            snapshot = Snapshot(self._slot, now_ns, joints=ports.joint_encoder.read(), wrench=ports.force_sensor.read())
            self._slot = next_slot(self._start_ns, self._slot, now_ns)
            trip = self._monitor.trip(snapshot)
            if trip is None:
                if dist(snapshot.wrench.force_N, self._first_N) > self._limit_N:
                    raise DeviceError("rig", f"the force changed by more than {self._limit_N:g} N {self._motion}")
                self._held = q_rad
            if self._held:
                self._send(self._held)
            if trip is None:
                return snapshot
        raise DeviceError("rig", f"{trip} {self._motion}")

    def _send(self, q_rad: JointVector) -> None:
        reason = self._ports.arm.send(JointCommand(q_rad)).reason
        if reason in (CommandReason.STOPPED, CommandReason.POSITION_LIMIT):
            # By then the fault that stopped the arm is known.
            self._ports.arm.stop()
            cause = self._stopped_by()
            why = f"{reason.value}{f', {cause}' if cause else ''}"
            raise DeviceError("rig", f"the arm was held back {self._motion}: {why}")


def recent_force_N(ports: Ports) -> Vector3:
    """Return a recent force, (3,) N, from a sensor that does not compensate for its load.

    Raises:
        DeviceError: There is no valid force, or its frame or kind is wrong.
    """
    for _ in range(_BLIND_TICKS):
        sample = ports.force_sensor.read()
        if sample.validity is Validity.VALID:
            require_raw(sample)
            return sample.force_N
        ports.clock.sleep_until(ports.clock.now_ns() + _TICK_NS)
    raise DeviceError("rig", f"force sample {sample.validity.value} before a motion")
