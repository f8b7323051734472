"""A complete adapter for an arm of your own: here one that speaks lines of text over a serial port.

The arm understands ``?`` (where are you), ``G a b c ...`` (go there, radians) and ``S`` (stop), and answers each with
``J a b c ...``, where its joints are. Encoders and servos are one device, so one object serves both ports.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import serial

from palpate.adapters.hardware import ArmAdapter, RigContext
from palpate.core.errors import CommandError, ConfigurationError, DeviceError
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    AppliedCommand,
    Clock,
    CommandLimiter,
    CommandReason,
    JointCommand,
    JointSample,
    JointVector,
    Life,
    ManagedDevice,
)


class Line(Protocol):
    """What the adapter needs of a serial port; pyserial's ports have it."""

    def write(self, data: bytes, /) -> object: ...

    def readline(self) -> bytes: ...

    def close(self) -> None: ...


class LineArm(ManagedDevice):
    """Joint encoders and servos of the arm.

    Args:
        open_line: Opens the way to the arm; called by ``configure``, never by the constructor.
        clock: The run's clock.
        limiter: Position and velocity limits.
    """

    def __init__(self, open_line: Any, clock: Clock, limiter: CommandLimiter) -> None:
        super().__init__("line arm")
        self._open_line, self._clock, self._limiter = open_line, clock, limiter
        self._line: Line | None = None
        self._held: JointVector = ()
        self._stopped = False
        self._sample: JointSample | None = None

    def read(self) -> JointSample:
        """Where the joints are; asked at most once per moment of the clock, so that a sample is a sample."""
        self._require_active("read()")
        now = self._clock.now_ns()
        if self._sample is None or now > self._sample.receive_time_ns:
            number = 0 if self._sample is None else self._sample.sequence + 1
            angles = self._ask(b"?")
            self._sample = JointSample(angles, now, self._clock.now_ns(), number)
        return self._sample

    def send(self, command: JointCommand) -> AppliedCommand:
        """Go there, within the limits."""
        self._require_active("send()")
        if len(command.position_rad) != self._limiter.joints:
            raise CommandError(f"the arm has {self._limiter.joints} joints", len(command.position_rad))
        if self._stopped:
            return AppliedCommand(self._held, CommandReason.STOPPED)
        applied = self._limiter.limited(command.position_rad, self._clock.now_ns())
        self._ask(b"G " + " ".join(map(repr, applied.position_rad)).encode())
        self._held = applied.position_rad
        return applied

    def stop(self) -> None:
        """Hold where it is. Never raises: when the line is dead there is no way left to stop the arm from here."""
        self._stopped = True
        if self._line is not None:
            try:
                self._held = self._ask(b"S")
            except DeviceError:
                # The device has latched the fault already, or is not to be reached.
                return

    def _ask(self, request: bytes) -> JointVector:
        if self._line is None:
            raise DeviceError(self.name, "is not open")
        try:
            self._line.write(request + b"\n")
            answer = self._line.readline().split()
            if not answer or answer[0] != b"J":
                raise DeviceError(self.name, f"answered {b' '.join(answer)!r} instead of its joints")
            return tuple(map(float, answer[1:]))
        except (OSError, ValueError, DeviceError) as error:
            problem = f"the line failed: {error}"
            self._latch(problem)
            raise DeviceError(self.name, problem) from error

    def _on_configure(self) -> None:
        try:
            self._line = self._open_line()
        except OSError as error:
            raise DeviceError(self.name, f"cannot be opened ({error})") from error

    def _on_activate(self) -> None:
        # Freed from the last stop, it holds where it stands.
        self._held, self._stopped, self._sample = self._ask(b"S"), False, None
        self._limiter.start(self._held)

    def _on_deactivate(self) -> None:
        self._ask(b"S")

    def _on_close(self) -> None:
        line, self._line = self._line, None
        if line is not None:
            try:
                if self._life is Life.ACTIVE:
                    line.write(b"S\n")
            except OSError:
                # The cable is cut: the arm cannot be told, and the line is to be released all the same.
                pass
            finally:
                line.close()


def make_arm(settings: Mapping[str, Any], context: RigContext) -> ArmAdapter:
    """Make the adapter from the table ``[arm]`` of a rig file."""
    port = settings.get("port")
    if not isinstance(port, str):
        raise ConfigurationError("arm.port", port, "the name of a serial port")
    limiter = CommandLimiter(context.lower_rad, context.upper_rad, context.velocity_limit_rad_s, CONTROL_RATE_HZ)
    arm = LineArm(lambda: serial.serial_for_url(port, 115200, timeout=0.1), context.clock, limiter)
    return ArmAdapter(arm, arm)
