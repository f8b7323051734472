"""An arm in another process as the two arm ports of this one."""

import itertools
from abc import abstractmethod
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final, Protocol

from typing_extensions import override

from palpate.adapters.hardware.bus_process.host import ASK, SET, STOP
from palpate.adapters.hardware.bus_process.wire import Board, HostedStatus, Report, Wire
from palpate.core.errors import DeviceError
from palpate.core.ports import (
    AppliedCommand,
    ArmCommand,
    Clock,
    CommandReason,
    DeviceDecorator,
    JointCommand,
    JointEncoder,
    JointSample,
    Life,
    ManagedDevice,
)

_ANSWER_NS: Final = 2_000_000
"""Longest that a set-point keeps the loop waiting for what became of it; usually it is a tenth of that."""
_STOP_NS: Final = 1_800_000_000
_REQUEST_NS: Final = 60_000_000_000
_CLOSE_NS: Final = 10_000_000_000
_LOOK_NS: Final = 1_000_000
"""How often whoever waits for an answer looks whether another thread has taken it in."""


class ArmProcess(Protocol):
    """The process that hosts the arm, as far as the loop's side has to do with it."""

    wire: Wire
    board: Board

    @abstractmethod
    def obituary(self) -> str:
        """How it came to its end, for a message."""

    @abstractmethod
    def end(self) -> None:
        """See to it that nothing of it is left; waits a little for it to end by itself."""


class HostedArm(ManagedDevice, JointEncoder, ArmCommand):
    """Encoders and servos of an arm that another process moves.

    Args:
        silence_ns: Time after which a process that has noted nothing counts as hanging.
    """

    def __init__(self, name: str, start: Callable[[], ArmProcess], clock: Clock, silence_ns: int) -> None:
        super().__init__(name)
        self._start, self._clock, self._silence_ns = start, clock, silence_ns
        self._process: ArmProcess | None = None
        self._status = HostedStatus(0)
        self._numbers = itertools.count(1)
        self._awaited: set[int] = set()
        self._answers: dict[int, tuple[Any, str | None]] = {}
        self._last_words = ""
        self._held = AppliedCommand((), CommandReason.VELOCITY_LIMIT)

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
        status = self._status
        if status.trouble is not None:
            raise status.trouble.error()
        if status.joints is None:
            raise DeviceError(self.name, "has not delivered a sample yet")
        return status.joints

    def account(self) -> str:
        """What the arm's wire gave of late besides good samples, as its process says."""
        return self._status.account

    @override
    def send(self, command: JointCommand) -> AppliedCommand:
        """Hand on set-points; where the process does not answer in time, the arm is said to hold what it held."""
        self._look()
        if self._life is not Life.ACTIVE:
            self._require_active("send()")
        content = (command.position_rad, self._clock.now_ns())
        answer = self._ask(SET, content, _ANSWER_NS)
        if answer is not None:
            outcome: AppliedCommand = self._outcome(answer)
            self._held = AppliedCommand(outcome.position_rad, CommandReason.VELOCITY_LIMIT)
            return outcome
        if self._life is not Life.ACTIVE:
            self._require_active("send()")
        if not self._held.position_rad:
            self._held = AppliedCommand(self.read().position_rad, CommandReason.VELOCITY_LIMIT)
        return self._held

    @override
    def stop(self) -> None:
        self._send_stop("")

    def hold(self, cause: str) -> None:
        """Stop, and latch there: nothing is applied any more, and once deactivated the arm has a fault.

        May come from a signal handler.
        """
        self._send_stop(cause)

    def _send_stop(self, cause: str) -> None:
        if self._process is not None:
            self._ask(STOP, cause, _STOP_NS)

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

    @override
    def _on_configure(self) -> None:
        process = self._process = self._start()
        try:
            self._request("configure")
        except BaseException:
            self._process = None
            process.end()
            raise

    @override
    def _on_activate(self) -> None:
        self._held = AppliedCommand((), CommandReason.VELOCITY_LIMIT)
        self._request("activate")

    @override
    def _on_deactivate(self) -> None:
        self._request("deactivate")

    @override
    def _on_acknowledge(self) -> None:
        if self._process is None:
            # It died. Whoever acknowledges that wants another one.
            self._on_configure()
        else:
            self._request("acknowledge_fault")

    @override
    def _on_close(self) -> None:
        process = self._process
        if process is None:
            return
        try:
            answer = self._ask(ASK, "close", _CLOSE_NS)
            if answer is not None and answer[0] is not None:
                raise answer[0].error()
        finally:
            self._process = None
            process.end()

    def _request(self, name: str) -> None:
        answer = self._ask(ASK, name, _REQUEST_NS)
        if answer is None:
            raise DeviceError(self.name, self._last_words or f"the arm's process does not answer to {name}()")
        self._outcome(answer)
        # What was noted before this counts no more.
        self._look()

    def _outcome(self, answer: tuple[Any, str | None]) -> Any:
        outcome, fault = answer
        if fault is not None:
            self._latch(fault)
        if isinstance(outcome, Report):
            raise outcome.error()
        return outcome

    def _ask(self, kind: str, content: object, patience_ns: int) -> tuple[Any, str | None] | None:
        """Send a message and wait for the answer; None where none comes, or nobody is there any more."""
        process, number = self._process, next(self._numbers)
        if process is None:
            return None
        deadline_ns = self._clock.now_ns() + patience_ns
        self._awaited.add(number)
        try:
            if not process.wire.put((kind, number, content)):
                return None
            while True:
                # Whoever takes an answer in, another thread or a signal handler for one, puts it where all look.
                self._take_in(process)
                if number in self._answers:
                    return self._answers.pop(number)
                now_ns = self._clock.now_ns()
                if now_ns >= deadline_ns:
                    return None
                process.wire.wait(min(deadline_ns, now_ns + _LOOK_NS))
        except EOFError:
            self._bury(process)
            return None
        finally:
            self._awaited.discard(number)

    def _take_in(self, process: ArmProcess) -> None:
        while (message := process.wire.take()) is not None:
            number, outcome, fault = message
            # A set-point's answer may come when nobody waits for it any more.
            if number in self._awaited:
                self._answers[number] = (outcome, fault)

    def _look(self) -> None:
        """Take in what the process has to say; never waits."""
        process = self._process
        if process is None:
            return
        try:
            self._take_in(process)
        except EOFError:
            self._bury(process)
            return
        # The time first: between the two this process may be stopped for a while itself.
        now_ns = self._clock.now_ns()
        status = process.board.read()
        if status is None:
            return
        self._status = status
        if status.fault is not None:
            self._latch(status.fault)
        silent_ns = now_ns - status.time_ns
        if silent_ns > self._silence_ns and self._life is Life.ACTIVE:
            self._latch(
                f"the arm's process has not run for {silent_ns * 1e-6:.0f} ms: it is stopped, hangs in its driver, or"
                " this computer is late; what stops the arm now is its drives' own time-outs"
            )

    def _bury(self, process: ArmProcess) -> None:
        if self._process is process:
            self._process = None
            self._last_words = (
                f"the arm's process {process.obituary()}; what stops the arm now is its drives' own time-outs; switch"
                " the arm off if it moves (this computer's fault, or that of whoever ended the process)"
            )
            self._latch(self._last_words)
            with suppress(OSError):
                process.end()


class OperatorsHand(DeviceDecorator, ArmCommand):
    """The arm as the operator's stop has it: a stop latches in the arm's own process."""

    def __init__(self, arm: HostedArm) -> None:
        super().__init__(arm)
        self._arm = arm

    def send(self, command: JointCommand) -> AppliedCommand:
        """Hand on set-points."""
        return self._arm.send(command)

    def stop(self) -> None:
        """Stop, and latch."""
        self._arm.hold("operator's stop")
