"""Encoder and servo ports for an arm that runs in a separate process."""

import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

from typing_extensions import override

from palpate.adapters.config import DeviceEntry, RealTimeConfig
from palpate.adapters.hardware.adapter_arm import served
from palpate.adapters.hardware.arm_host import ArmProcess
from palpate.adapters.hardware.arm_memory import ArmStatus, Setpoint
from palpate.adapters.hardware.arm_process import PACE_NS, Assignment
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.plugins import RigContext, arm_maker
from palpate.adapters.hardware.served_arm import ServedArm, StandBy
from palpate.core.errors import CommandError, DeviceError
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    AppliedCommand,
    ArmCommand,
    Clock,
    CommandReason,
    JointCommand,
    JointEncoder,
    JointSample,
    JointVector,
    Life,
    ManagedDevice,
    Validity,
)

_NS: Final = 1_000_000_000
_ANSWER_NS: Final = 2_000_000
"""Maximum time that the loop waits for a third-party arm to answer a set-point."""
_STOP_NS: Final = 9 * _NS // 5
_REQUEST_NS: Final = 60 * _NS
_CLOSE_NS: Final = 10 * _NS
_HANGS_NS: Final = 2 * _NS // 5
"""Period of inactivity, beyond the set-point time-out, after which a process counts as hung. A cycle takes time on an
unresponsive line."""
_LATE_NS: Final = 40_000_000
"""Period of inactivity after which a process counts as late or dead. An arm without its own stop is then held."""
_LEFT: Final = "only the drives' own time-outs stop the arm now; switch it off if it moves"


class ArmClient(ManagedDevice, JointEncoder, ArmCommand):
    """Encoders and servos of an arm in a separate process; ``notify`` receives the messages from opening the arm.

    Attributes:
        listens: True to read only angles, without power or commands. Set it before :meth:`activate`.
    """

    def __init__(
        self,
        arm: ServedArm,
        start: Callable[[], ArmProcess],
        clock: Clock,
        timeout_ns: int,
        notify: Callable[[str], object] = str,
    ) -> None:
        super().__init__(arm.name)
        self._arm, self._start, self._clock = arm, start, clock
        self._silence_ns, self._notify, self.listens = timeout_ns + _HANGS_NS, notify, False
        self._limiter = arm.limiter
        self._host: ArmProcess | None = None
        self._stand_by: StandBy | None = None
        self._held_heartbeat_ns = 0
        self._status = ArmStatus()
        self._sent = self._requests = 0
        self._stopped = False
        self._last_words = ""

    @property
    @override
    def life(self) -> Life:
        self._look()
        return self._life

    @property
    @override
    def fault(self) -> str | None:
        self._look()
        return self._fault

    @override
    def read(self) -> JointSample:
        self._look()
        if self._life is not Life.ACTIVE:
            self._require_active("read()")
        sample = self._status.joints
        if sample is None:
            raise DeviceError(self.name, "has not delivered a sample yet")
        if len(sample.position_rad) != self._limiter.joints:
            problem = f"gives {len(sample.position_rad)} joint angles, the arm has {self._limiter.joints}"
            raise DeviceError(self.name, problem)
        if self._arm.max_age_ns and self._clock.now_ns() - sample.source_time_ns > self._arm.max_age_ns:
            old = (sample.source_time_ns, sample.receive_time_ns, sample.sequence)
            return JointSample(sample.position_rad, *old, Validity.STALE)
        return sample

    def diagnostics(self) -> dict[str, str]:
        """Return the arm's diagnostics, or an empty mapping while it is not open."""
        found: dict[str, str] = {} if self._host is None else self._request("diagnostics")
        return found

    @property
    def rate_Hz(self) -> float | None:
        """The arm's cycle rate, or None for a third-party arm, whose rate is unknown."""
        return None if self._arm.answers else CONTROL_RATE_HZ / self._arm.divider

    @property
    def listens_unpowered(self) -> bool:
        """True if the arm reports angles without power."""
        return self._arm.listens_unpowered

    def send(self, command: JointCommand) -> AppliedCommand:
        """Send a set-point. It is limited here for a palpate driver; a third-party arm reports what it applied."""
        self._look()
        if self._life is not Life.ACTIVE:
            self._require_active("send()")
        requested, host = command.position_rad, self._host
        if len(requested) != self._limiter.joints:
            joints = self._limiter.joints
            raise CommandError(f"the arm has {joints} joints, the command has another number", len(requested))
        if self._stopped or self.listens or host is None:
            return AppliedCommand(self._where(), CommandReason.STOPPED)
        now_ns = self._clock.now_ns()
        applied = AppliedCommand(requested) if self._arm.answers else self._limiter.limited(requested, now_ns)
        self._sent += 1
        host.memory.setpoint.write(Setpoint(self._sent, now_ns, applied.position_rad))
        if self._arm.answers:
            return self._answered(now_ns + _ANSWER_NS)
        if self._is_stopped():
            # Stopped by a signal handler meanwhile: the arm's process accepts no more set-points.
            return AppliedCommand(self._where(), CommandReason.STOPPED)
        return applied

    def _is_stopped(self) -> bool:
        return self._stopped

    def _answered(self, deadline_ns: int) -> AppliedCommand:
        """Return the command applied for the latest set-point, or the previous command if the deadline passes."""
        while self._status.taken < self._sent and self._clock.now_ns() < deadline_ns:
            self._clock.sleep_until(self._clock.now_ns() + PACE_NS // 5)
            self._look()
        if self._life is not Life.ACTIVE:
            self._require_active("send()")
        applied = self._status.applied
        if self._stopped or applied is None:
            reason = CommandReason.STOPPED if self._stopped else CommandReason.VELOCITY_LIMIT
            return AppliedCommand(self._where(), reason)
        if self._status.taken < self._sent:
            return AppliedCommand(applied.position_rad, CommandReason.VELOCITY_LIMIT)
        return applied

    def _where(self) -> JointVector:
        return () if self._status.joints is None else self._status.joints.position_rad

    def stop(self) -> None:
        """Stop the arm, and wait for confirmation or a time-out. Signal handlers may call this."""
        self._stopped = True
        host, requested_ns = self._host, self._clock.now_ns()
        if host is None or self._life is Life.CONSTRUCTED:
            return
        host.memory.stop_requested_ns = requested_ns
        while host.memory.stopped_ns < requested_ns and host.is_alive():
            if self._clock.now_ns() > requested_ns + _STOP_NS:
                return
            self._clock.sleep_until(self._clock.now_ns() + PACE_NS)

    @override
    def activate(self) -> None:
        self._look()
        super().activate()

    @override
    def deactivate(self) -> None:
        self._look()
        super().deactivate()

    @override
    def acknowledge_fault(self) -> None:
        self._look()
        super().acknowledge_fault()

    def _on_configure(self) -> None:
        host = self._host = self._start()
        self._status = ArmStatus()
        try:
            for line in self._request("configure"):
                self._notify(line)
            self._stand_down()
            self._stand_by = self._arm.stand_by()
        except BaseException:
            self._host = None
            host.end()
            raise

    def _on_activate(self) -> None:
        self._stopped = False
        self._request("listen" if self.listens else "activate")
        self._limiter.start(self._where())

    def _on_deactivate(self) -> None:
        self._request("deactivate")

    def _on_acknowledge(self) -> None:
        if self._host is None:
            # The process died; acknowledging the fault starts a new one.
            self._on_configure()
        else:
            self._request("acknowledge_fault")

    def _on_close(self) -> None:
        self._stand_down()
        host = self._host
        if host is None:
            return
        try:
            self._request("close", _CLOSE_NS)
        except DeviceError:
            if self._host is not None:
                raise
            # The process is gone, as reported before.
        finally:
            self._host = None
            host.end()

    def _request(self, name: str, wait_ns: int = _REQUEST_NS) -> Any:
        host, deadline_ns = self._host, self._clock.now_ns() + wait_ns
        if host is None:
            raise DeviceError(self.name, self._last_words)
        self._requests += 1
        answered = 0
        try:
            host.line.send((self._requests, name))
            # The reply to a request that timed out may arrive first.
            while answered != self._requests:
                while not host.line.poll(0):
                    if self._clock.now_ns() > deadline_ns:
                        self._bury(host, f"does not answer to {name}()")
                        raise DeviceError(self.name, self._last_words)
                    self._clock.sleep_until(self._clock.now_ns() + PACE_NS)
                answered, found, problem, fault = host.line.recv()
        except (EOFError, OSError) as error:
            self._bury(host)
            raise DeviceError(self.name, self._last_words) from error
        self._status = host.memory.status.read()
        if fault is not None:
            self._latch(fault)
        if problem is not None:
            raise problem
        return found

    def _look(self) -> None:
        """Read the state published by the other process without waiting."""
        host = self._host
        if host is None:
            return
        # The time is read first, because this process may be suspended between the two.
        now_ns = self._clock.now_ns()
        silent_ns = now_ns - host.memory.heartbeat_ns
        self._status = host.memory.status.read()
        if self._status.fault is not None:
            self._latch(self._status.fault)
        if not host.is_alive():
            self._bury(host)
        elif silent_ns > self._silence_ns and self._life is Life.ACTIVE:
            self._bury(host, f"has not run for {silent_ns * 1e-6:.0f} ms, stopped or hanging in its driver")
        elif silent_ns > _LATE_NS and host.memory.heartbeat_ns != self._held_heartbeat_ns:
            # A killed process takes time to end. A late one continues from where the arm was held.
            self._held_heartbeat_ns = host.memory.heartbeat_ns
            self._hold()

    def _bury(self, host: ArmProcess, cause: str = "") -> None:
        """Abandon the process, and make sure that it cannot move the arm again."""
        if self._host is host:
            self._host = None
            end = host.kill()
            self._hold()
            self._last_words = f"the arm's process {cause or end}; {_LEFT}"
            self._latch(self._last_words)

    def _hold(self) -> None:
        """Hold a moving arm if its controller would keep running without commands."""
        if self._stand_by is not None and self._life is Life.ACTIVE and not self._stopped and not self.listens:
            with suppress(DeviceError):
                self._stand_by.hold(self._where())

    def _stand_down(self) -> None:
        stand_by, self._stand_by = self._stand_by, None
        if stand_by is not None:
            stand_by.close()


def arm_in_process(entry: DeviceEntry, context: RigContext, real_time: RealTimeConfig, timeout_ns: int) -> ArmClient:
    """Return an arm from a rig file; it runs in a separate process that ``configure`` starts.

    Args:
        timeout_ns: Time without a set-point after which the process stops the arm.

    Raises:
        ConfigurationError: There is no such adapter, or it rejects its settings.
    """
    clock = context.clock
    if not isinstance(clock, MonotonicClock):
        raise TypeError("another process needs real time")
    # Also created here, without opening it, so that an invalid rig file is refused before anything starts.
    arm = served(arm_maker(entry.adapter)(entry.settings, context), context)
    assignment = Assignment(entry, context.portable(), clock, real_time, timeout_ns, tuple(sys.path))
    return ArmClient(arm, lambda: ArmProcess(assignment), clock, timeout_ns, context.notify)
