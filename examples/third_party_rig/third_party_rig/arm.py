"""The arm. Its encoders and servos form a single device, so one object serves both ports."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from palpate.adapters.hardware import ArmAdapter, RigContext
from palpate.core.errors import CommandError
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    AppliedCommand,
    ArmCommand,
    Clock,
    CommandLimiter,
    CommandReason,
    JointCommand,
    JointEncoder,
    JointSample,
    JointVector,
)
from third_party_rig.device import BenchDevice, address


class BenchArm(BenchDevice, ArmCommand, JointEncoder):
    """The joint encoders and servos of the arm.

    Args:
        at: Host and port.
        clock: The run's clock.
        limiter: Limiter that enforces position and velocity limits, and reports its changes.
    """

    def __init__(self, at: tuple[str, int], clock: Clock, limiter: CommandLimiter) -> None:
        super().__init__("bench-arm", limiter.joints, at, clock)
        self._limiter, self._stopped = limiter, False
        self._sample: JointSample | None = None

    def read(self) -> JointSample:
        """Return the latest angles, or the same sample again if there is no new one."""
        self._require_active("read()")
        validity = self._take_in()
        last = self._sample
        if last is None or (last.sequence, last.validity) != (self._sequence, validity):
            new = self._newest.values
            self._sample = last = JointSample(new, self._source_ns, self._heard_ns, self._sequence, validity)
        return last

    def send(self, command: JointCommand) -> AppliedCommand:
        """Send a limited command without waiting for a reply. Only missing samples reveal a lost connection."""
        self._require_active("send()")
        if len(command.position_rad) != self._limiter.joints:
            raise CommandError(f"the arm has {self._limiter.joints} joints", len(command.position_rad))
        self._take_in()
        if self._stopped:
            return AppliedCommand(self._here(), CommandReason.STOPPED)
        applied = self._limiter.limited(command.position_rad, self._clock.now_ns())
        try:
            self._opened().write("G " + " ".join(map(repr, applied.position_rad)))
        except OSError as error:
            self._fail(str(error))
        return applied

    def stop(self) -> None:
        """Hold the current position, from any thread and in any state. This method only writes, so it cannot block."""
        self._stopped = True
        self._say("S")

    def _here(self) -> JointVector:
        return self._newest.values

    def _on_activate(self) -> None:
        super()._on_activate()
        # Freed from the last stop, it holds where it stands, and limits count from there.
        self._sample, self._stopped = None, False
        self._limiter.start(self._here())


def make_arm(settings: Mapping[str, Any], context: RigContext) -> ArmAdapter:
    """Create the arm specified in the ``[arm]`` table of a rig file."""
    limiter = CommandLimiter(context.lower_rad, context.upper_rad, context.velocity_limit_rad_s, CONTROL_RATE_HZ)
    arm = BenchArm(address("arm", settings), context.clock, limiter)
    return ArmAdapter(arm, arm)
