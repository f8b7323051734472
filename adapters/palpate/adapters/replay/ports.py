"""The four ports for a recorded trial. Inputs come from the log, and outputs are compared with the log."""

from typing import Generic

from typing_extensions import override

from palpate.adapters.replay.tape import T, Tape, Track
from palpate.core.ports import (
    AppliedCommand,
    ArmCommand,
    Clock,
    CommandReason,
    JointCommand,
    JointVector,
    Life,
    ManagedDevice,
)


class ReplayClock(Clock):
    """Clock that returns recorded readings."""

    def __init__(self, tape: Tape) -> None:
        self._tape = tape

    def now_ns(self) -> int:
        """Return the recorded reading for this call."""
        return self._tape.clock.next()

    def sleep_until(self, deadline_ns: int) -> None:
        """Start the next tick without waiting."""
        self._tape.tick += 1
        self._tape.check_deadline(deadline_ns)


class ReplaySensor(ManagedDevice, Generic[T]):
    """Sensor that returns the recorded samples."""

    def __init__(self, name: str, track: Track[T]) -> None:
        super().__init__(name)
        self._track = track

    def read(self) -> T:
        """Return the recorded sample for this call."""
        if self._life is not Life.ACTIVE:
            self._track.pass_refused()
            self._require_active("read()")
        return self._track.next()


class ReplayArm(ManagedDevice, ArmCommand):
    """Arm that responds to commands like the recorded arm, and records commands that differ.

    After the first difference, the arm's response is unknown. The requested command then counts as applied, unless the
    recorded arm was limited or stopped at that time.
    """

    def __init__(self, tape: Tape) -> None:
        super().__init__("recorded arm")
        self._tape = tape
        self._stopped = False
        self._held: JointVector = ()

    @override
    def send(self, command: JointCommand) -> AppliedCommand:
        tape, requested = self._tape, command.position_rad
        if self._life is not Life.ACTIVE:
            tape.sends.pass_refused()
            self._require_active("send()")
        if self._stopped and not tape.sends.left:
            return AppliedCommand(self._held, CommandReason.STOPPED)
        applied = tape.next_answer(requested)
        if applied.reason is CommandReason.AS_REQUESTED and tape.differences.first_command_tick is not None:
            applied = AppliedCommand(requested)
        self._held = applied.position_rad
        return applied

    @override
    def stop(self) -> None:
        # Nothing moves here. The call, and any failure in it, is compared with the log.
        if self._life is Life.ACTIVE:
            self._stopped = True
            if self._tape.stops.left:
                self._tape.stops.next()
