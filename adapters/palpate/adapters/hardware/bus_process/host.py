"""The arm's own process at work: hands on what the loop says, and stops the arm when the loop says nothing more."""

import threading
from collections.abc import Callable, Mapping
from typing import Any, Final

from palpate.adapters.hardware.bus_process.wire import Board, HostedStatus, Report, Wire
from palpate.adapters.hardware.plugins import ArmAdapter
from palpate.core.ports import (
    AppliedCommand,
    Clock,
    CommandReason,
    Device,
    JointCommand,
    JointSample,
    Life,
    ManagedDevice,
)

PACE_NS: Final = 1_000_000
"""How often to look at the joints, and whether the loop still lives."""
_END_NS: Final = 3_000_000_000
"""Longest wait for the arm to be told to stop, and then to be closed, once the loop is gone."""

_SWING_NS: Final = 500_000_000
"""How long an arm that was stopped in full motion may go on swinging."""

SET, ASK, STOP = "set", "ask", "stop"
"""What the loop's side may send: a set-point, a request of the life cycle by its name, a stop and perhaps a latch."""


class HostedPair(ManagedDevice):
    """Encoders and servos of an arm with one life, and with the latch of what stopped them.

    Args:
        adapter: The arm. Where encoders and servos are two objects, they live together.
    """

    def __init__(self, adapter: ArmAdapter) -> None:
        super().__init__(str(getattr(adapter.arm, "name", "arm")))
        self._adapter = adapter
        devices: tuple[Device, ...] = (adapter.encoder, adapter.arm)
        self._devices = tuple({id(device): device for device in devices}.values())
        self._held = ""

    def trip(self, cause: str) -> None:
        """Latch; the first cause is kept."""
        self._latch(cause)

    def hold(self, cause: str) -> None:
        """Apply nothing that is sent from now on; once deactivated, it is a fault that waits for a person."""
        self._held = self._held or cause

    def look(self) -> None:
        """Take over what the devices have latched themselves."""
        for device in self._devices:
            if device.life is Life.FAULTED:
                self._latch(device.fault or "a fault that says nothing of itself")

    def read(self) -> JointSample:
        """Newest joint angles."""
        return self._adapter.encoder.read()

    def account(self) -> str:
        """What the encoders' wire gave of late besides good samples, where they tell."""
        return str(getattr(self._adapter.encoder, "account", str)())

    def send(self, command: JointCommand) -> AppliedCommand:
        """Hand on set-points, unless the arm is held."""
        self._require_active("send()")
        if self._held:
            return AppliedCommand(self.read().position_rad, CommandReason.STOPPED)
        return self._adapter.arm.send(command)

    def stop(self) -> None:
        """Bring the arm to rest."""
        self._adapter.arm.stop()

    def _on_configure(self) -> None:
        for device in self._devices:
            device.configure()

    def _on_activate(self) -> None:
        for device in self._devices:
            device.activate()

    def _on_deactivate(self) -> None:
        for device in reversed(self._devices):
            if device.life is Life.ACTIVE:
                device.deactivate()
        if self._held:
            self._latch(self._held)

    def _on_acknowledge(self) -> None:
        self._held = ""
        for device in self._devices:
            if device.life is Life.FAULTED:
                device.acknowledge_fault()
        self._on_deactivate()

    def _on_close(self) -> None:
        for device in reversed(self._devices):
            device.close()


class _Job:
    """Something that may take long, in a thread of its own."""

    def __init__(self, name: str, call: Callable[[], object], clock: Clock, *numbers: int) -> None:
        self.numbers, self._call, self._clock = list(numbers), call, clock
        self.error: Exception | None = None
        self._thread = threading.Thread(target=self._run, name=f"{name} request bus", daemon=True)
        self._thread.start()

    @property
    def done(self) -> bool:
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            # Under a clock on which threads take turns, this one waits for its own.
            self._clock.now_ns()
            self._call()
        except Exception as error:
            self.error = error


class Host:
    """Serves one loop until it says goodbye, or is gone.

    Args:
        deadman_ns: Time without a set-point, while set-points move the arm, after which it is brought to rest.
    """

    def __init__(
        self,
        wire: Wire,
        board: Board,
        pair: HostedPair,
        clock: Clock,
        deadman_ns: int,
        is_orphan: Callable[[], bool] = lambda: False,
    ) -> None:
        self._wire, self._board, self._pair, self._clock = wire, board, pair, clock
        self._deadman_ns, self._is_orphan = deadman_ns, is_orphan
        self._requests: Mapping[str, Callable[[], None]] = {
            "configure": pair.configure,
            "activate": pair.activate,
            "deactivate": pair.deactivate,
            "acknowledge_fault": self._set_free,
            "close": self._close,
        }
        self._waiting: list[tuple[int, str]] = []
        self._request: _Job | None = None
        self._stop: _Job | None = None
        self._set: tuple[int, Any] | None = None
        self._fed_ns: int | None = None
        """When the newest set-point was sent that moves the arm; None while nothing needs to come."""
        self._closed = False

    def serve(self) -> bool:
        """Until the loop has had the arm closed, or is gone; True if it was gone."""
        try:
            while not (self._closed and self._request is None):
                if self._is_orphan():
                    return True
                self._wire.wait(self._clock.now_ns() + PACE_NS)
                self._step()
        except EOFError:
            return True
        finally:
            self._end()
        return False

    def _step(self) -> None:
        while (message := self._wire.take()) is not None:
            self._take(*message)
        self._send_newest()
        self._watch()
        # Noted before it is answered: whoever has the answer finds on the board what came of it.
        done = [job for job in (self._stop, self._request) if job is not None and job.done]
        if self._request is None or self._request in done:
            # Not in the middle of one, which may be about to clear a fault.
            self._pair.look()
        self._board.write(self._status())
        for job in done:
            self._answer_job(job)
        if self._waiting and self._request is None:
            number, name = self._waiting.pop(0)
            self._request = _Job(self._pair.name, self._requests[name], self._clock, number)

    def _take(self, kind: str, number: int, content: Any) -> None:
        if kind == SET:
            # The newest wins: those before it are of the past.
            self._set = (number, content)
            return
        self._set = self._fed_ns = None
        if kind == ASK:
            self._waiting.append((number, content))
            return
        if content:
            self._pair.hold(content)
        self._begin_stop(number)

    def _send_newest(self) -> None:
        if self._set is None:
            return
        (number, (angles, sent_ns)), self._set = self._set, None
        outcome: object
        try:
            outcome = applied = self._pair.send(JointCommand(angles))
            self._fed_ns = None if applied.reason is CommandReason.STOPPED else sent_ns
        except Exception as error:
            outcome = Report.of(error, self._pair.name)
        self._pair.look()
        self._wire.put((number, outcome, self._pair.fault))

    def _watch(self) -> None:
        """The deadman: the arm comes to rest when the newest set-point is too old."""
        if self._fed_ns is None:
            return
        age_ns = self._clock.now_ns() - self._fed_ns
        if age_ns > self._deadman_ns:
            self._fed_ns = None
            self._begin_stop()
            limit = f"no set-point for {age_ns * 1e-6:.1f} ms, {self._deadman_ns * 1e-6:.1f} ms are allowed"
            self._pair.trip(f"deadman: {limit}")

    def _begin_stop(self, *numbers: int) -> None:
        if self._stop is None or self._stop.done:
            unanswered = () if self._stop is None else self._stop.numbers
            self._stop = _Job(self._pair.name, self._pair.stop, self._clock, *unanswered, *numbers)
        else:
            self._stop.numbers += numbers

    def _answer_job(self, job: _Job) -> None:
        if job is self._stop:
            # One that overtook the stop.
            self._fed_ns = None
        outcome = None if job.error is None else Report.of(job.error, self._pair.name)
        while job.numbers and self._wire.put((job.numbers[0], outcome, self._pair.fault)):
            del job.numbers[0]
        if not job.numbers:
            self._stop = None if job is self._stop else self._stop
            self._request = None if job is self._request else self._request

    def _status(self) -> HostedStatus:
        joints = trouble = None
        if self._pair.life is Life.ACTIVE:
            try:
                joints = self._pair.read()
            except Exception as error:
                trouble = Report.of(error, self._pair.name)
        return HostedStatus(self._clock.now_ns(), self._pair.fault, joints, trouble, self._pair.account())

    def _set_free(self) -> None:
        if self._pair.life is Life.ACTIVE:
            # The loop's side has latched something of its own.
            self._pair.deactivate()
        else:
            self._pair.acknowledge_fault()

    def _close(self) -> None:
        try:
            self._pair.close()
        finally:
            self._closed = True

    def _end(self) -> None:
        """Stop and close, whatever is under way; not for ever."""
        if self._pair.life is not Life.CLOSED:
            self._begin_stop()
            self._await(self._stop)
            self._await(self._request)
            if self._pair.life is not Life.CONSTRUCTED:
                # Some arms are left alone for good now, and keep where they stood: not where they swung.
                self._clock.sleep_until(self._clock.now_ns() + _SWING_NS)
            self._await(_Job(self._pair.name, self._pair.close, self._clock))
        self._wire.close()

    def _await(self, job: _Job | None) -> None:
        deadline_ns = self._clock.now_ns() + _END_NS
        while job is not None and not job.done and self._clock.now_ns() < deadline_ns:
            self._clock.sleep_until(self._clock.now_ns() + PACE_NS)
