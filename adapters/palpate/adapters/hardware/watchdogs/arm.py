"""An arm that stops when its commands stop coming."""

from __future__ import annotations

from palpate.adapters.hardware.watchdogs.age_watch import AgeWatch
from palpate.adapters.hardware.watchdogs.trip import Latch, TellTrip, WatchdogTrip, stop_surely, tell_surely
from palpate.core.ports.decorator import DeviceDecorator
from palpate.core.ports.devices import ArmCommand, Clock
from palpate.core.ports.values import AppliedCommand, CommandReason, JointCommand


class WatchedArm(DeviceDecorator, ArmCommand):
    """Stops the arm when the newest command is too old: from a thread of its own, for the loop may be dead.

    It watches from the first command that the arm accepts until the arm is stopped, deactivated or closed. A trip stays
    until the arm is activated again.

    Args:
        arm: The arm. Its ``stop`` is called from another thread.
        clock: The run's clock.
        max_command_age_ns: Age of the newest command at which the arm still goes on.
        tell: Is told of a trip, by the thread or by whoever sends.

    Attributes:
        stop_trouble: Why the arm could not be told of the last ``stop``; empty when it could.
    """

    def __init__(self, arm: ArmCommand, clock: Clock, max_command_age_ns: int, *, tell: TellTrip | None = None) -> None:
        super().__init__(arm)
        self._arm, self._clock, self._limit_ns, self._tell = arm, clock, max_command_age_ns, tell
        self.stop_trouble = ""
        self._latch = Latch()
        self._watch = AgeWatch("command watchdog", clock, max_command_age_ns, self._too_old)

    @property
    def tripped(self) -> WatchdogTrip | None:
        """The trip, until the arm is activated again; or None."""
        return self._latch.tripped

    def activate(self) -> None:
        """See :class:`palpate.core.ports.devices.Device`."""
        super().activate()
        self._latch.clear()

    def deactivate(self) -> None:
        """See :class:`palpate.core.ports.devices.Device`."""
        self._watch.rest()
        super().deactivate()

    def close(self) -> None:
        """See :class:`palpate.core.ports.devices.Device`."""
        self._watch.rest()
        try:
            super().close()
        finally:
            self._watch.end()

    def send(self, command: JointCommand) -> AppliedCommand:
        """See :class:`ArmCommand`. A command that comes too late finds the arm stopped."""
        self._watch.check()
        was_tripped = self._latch.tripped is not None
        applied = self._arm.send(command)
        if applied.reason is CommandReason.STOPPED:
            self._watch.rest()
            return applied
        if was_tripped:
            # Somebody has activated the arm again underneath.
            self._latch.clear()
        self._watch.feed()
        return applied

    def stop(self) -> None:
        """See :class:`ArmCommand`. Takes no lock, and tells nobody: a signal handler may call it."""
        self._watch.rest()
        self.stop_trouble = stop_surely(self._arm)

    def check(self) -> bool:
        """Look now whether the newest command is too old; True if the arm was stopped for it."""
        return self._watch.check()

    def _too_old(self, age_ns: int) -> None:
        trouble = stop_surely(self._arm)
        text = f"no command for {age_ns * 1e-6:.1f} ms, {self._limit_ns * 1e-6:.1f} ms are allowed{trouble}"
        trip = WatchdogTrip(self._clock.now_ns(), "command age", text)
        if self._latch.trip(trip):
            tell_surely(self._tell, trip)
