"""Process that owns an arm. It reads the latest set-point, cycles the arm, and stops it if no new set-points arrive."""

import mmap
import os
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from multiprocessing.connection import Connection
from typing import Final, NamedTuple

from palpate.adapters.config import DeviceEntry, RealTimeConfig
from palpate.adapters.hardware.adapter_arm import served
from palpate.adapters.hardware.arm_memory import ArmMemory, ArmStatus, Setpoint
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.plugins import RigContext, arm_maker
from palpate.adapters.hardware.real_time import RealTime, take_real_time
from palpate.adapters.hardware.served_arm import ServedArm
from palpate.adapters.signals import ignore_ending_signals
from palpate.core.errors import DeviceError, PalpateError
from palpate.core.ports import CONTROL_RATE_HZ, AppliedCommand, Clock, JointSample

PACE_NS: Final = 1_000_000
"""Interval at which the process checks for a stop and a set-point, and that the loop is alive."""
_NS: Final = 1_000_000_000
_FIRST_NS: Final = 3 * _NS
"""Maximum time to wait for the first sample."""
_SWING_NS: Final = _NS // 2
"""Maximum time for which an arm oscillates after a stop from full speed."""
_SWITCH_S: Final = 0.0001
_LONGEST: Final = 2000
"""Maximum message length, because notes have a fixed size."""


_PLAIN: Final = (str, int, float, tuple, list, type(None))


class ArmLoop:
    """Server that runs until the loop closes the arm or ends. It stops the arm if a set-point is overdue."""

    def __init__(
        self,
        arm: ServedArm,
        line: Connection,
        memory: ArmMemory,
        clock: Clock,
        timeout_ns: int,
        is_orphan: Callable[[], bool] = lambda: False,
    ) -> None:
        self._arm, self._line, self._memory, self._clock = arm, line, memory, clock
        self._timeout_ns, self._is_orphan = timeout_ns, is_orphan
        self._requests: Mapping[str, Callable[[], object]] = {
            "configure": arm.open,
            "diagnostics": lambda: dict(arm.diagnostics()),
            "activate": self._activate,
            "listen": self._only_listen,
            "deactivate": self._deactivate,
            "acknowledge_fault": self._acknowledge,
            "close": self._close,
        }
        self._cycles = self._closed = self._is_enabled = False
        self._stopped = True
        self._requested_ns = memory.stop_requested_ns
        self._fault: str | None = None
        self._sample: JointSample | None = None
        self._applied: AppliedCommand | None = None
        self._taken = 0
        self._start_ns = self._slot = 0

    def serve(self) -> bool:
        """Serve until the loop closes the arm or ends. Return True if the loop ended while the arm had power."""
        try:
            # On a clock on which threads take turns, this thread waits for its turn.
            self._clock.now_ns()
            while not self._closed:
                self._look()
                self._wait()
        except (EOFError, OSError):
            return self._is_enabled
        finally:
            self._end()
        return False

    def _wait(self) -> None:
        """Cycle the arm if a cycle is due, then sleep until the next event."""
        until_ns = self._clock.now_ns() + PACE_NS
        if self._cycles:
            if self._arm.answers or self._clock.now_ns() >= self._due_ns:
                self._cycle()
            until_ns = min(until_ns, max(self._due_ns, self._clock.now_ns()))
        self._memory.heartbeat_ns = self._clock.now_ns()
        self._clock.sleep_until(until_ns)

    @property
    def _due_ns(self) -> int:
        return self._start_ns + self._slot * _NS * self._arm.divider // CONTROL_RATE_HZ

    def _look(self) -> None:
        if self._is_orphan():
            raise EOFError
        while self._line.poll(0):
            self._answer(*self._line.recv())
        if (requested_ns := self._memory.stop_requested_ns) != self._requested_ns:
            self._requested_ns = requested_ns
            self._stop()
            self._memory.stopped_ns = self._clock.now_ns()
        setpoint = self._newest()
        if setpoint is not None and (age_ns := self._clock.now_ns() - setpoint.sent_ns) > self._timeout_ns:
            self._stop()
            limit = f"no set-point for {age_ns * 1e-6:.1f} ms, {self._timeout_ns * 1e-6:.1f} ms are allowed"
            self._latch(f"set-point time-out: {limit}")

    def _newest(self) -> Setpoint | None:
        """Return the valid set-point, or None if there is none."""
        setpoint = self._memory.setpoint.read()
        if self._stopped or setpoint is None or setpoint.sent_ns < self._start_ns:
            return None
        return setpoint

    def _cycle(self) -> None:
        now_ns, setpoint = self._clock.now_ns(), self._newest()
        reached = (now_ns - self._start_ns) * CONTROL_RATE_HZ // (_NS * self._arm.divider) + 1
        self._slot = max(self._slot + 1, reached)
        if self._arm.answers and setpoint is not None and setpoint.number <= self._taken:
            # A third-party arm gets each set-point once.
            setpoint = None
        try:
            self._sample, applied = self._arm.cycle(None if setpoint is None else setpoint.position_rad)
        except Exception as error:
            # After any error, the arm must not continue without its cycles.
            self._cycles = False
            self._latch(self._cause(error))
            self._stop()
            return
        if setpoint is not None:
            self._taken, self._applied = setpoint.number, applied
        self._publish()

    def _cause(self, error: Exception) -> str:
        if isinstance(error, PalpateError):
            return str(error).removeprefix(f"{self._arm.name}: ")
        return f"its adapter failed: {error!r}"

    def _latch(self, cause: str) -> None:
        self._fault = self._fault or cause[:_LONGEST]
        self._publish()

    def _publish(self) -> None:
        self._memory.status.write(ArmStatus(self._fault, self._sample, self._applied, self._taken))
        self._memory.heartbeat_ns = self._clock.now_ns()

    def _stop(self) -> None:
        """Stop the arm once; it stays stopped until it is activated again."""
        if not self._stopped:
            self._stopped = True
            try:
                self._arm.stop()
            except Exception as error:
                self._latch(f"stop() failed: {error!r}")

    def _answer(self, number: int, request: str) -> None:
        found, problem = None, None
        try:
            found = self._requests[request]()
        except PalpateError as error:
            problem = error
            # Errors may hold any object, and not every object can be sent to another process.
            vars(problem).update(
                {name: repr(value) for name, value in vars(error).items() if type(value) not in _PLAIN}
            )
        except Exception as error:
            problem = DeviceError(self._arm.name, self._cause(error))
        # Published before the reply: the client then finds the result in the memory.
        if not self._closed:
            self._publish()
        self._line.send((number, found, problem, self._fault))

    def _activate(self) -> None:
        try:
            self._arm.enable()
        except PalpateError as error:
            if self._arm.is_faulted:
                self._latch(self._cause(error))
            raise
        self._is_enabled, self._stopped = True, False
        self._begin()

    def _only_listen(self) -> None:
        self._is_enabled = self._arm.listen()
        self._begin()

    def _begin(self) -> None:
        """Cycle the arm, and wait for the first sample."""
        self._sample = None
        self._start_ns, self._slot, self._cycles = self._clock.now_ns(), 0, True
        while self._cycles and self._sample is None and self._clock.now_ns() < self._start_ns + _FIRST_NS:
            self._cycle()
            self._clock.sleep_until(self._due_ns)
        if self._sample is None:
            self._cycles = False
            self._stop()
            raise DeviceError(self._arm.name, self._fault or "delivers no joint angles")

    def _deactivate(self) -> None:
        self._cycles = False
        self._disable()

    def _disable(self) -> None:
        self._stop()
        if self._is_enabled:
            self._arm.disable()
            self._is_enabled = False

    def _acknowledge(self) -> None:
        self._cycles = False
        if self._arm.is_faulted:
            self._stop()
            self._arm.acknowledge()
            self._is_enabled = False
        else:
            self._disable()
        self._fault = None

    def _close(self) -> None:
        self._cycles, self._closed = False, True
        self._stop()
        self._arm.close()

    def _end(self) -> None:
        """Stop and close the arm if the loop has ended without closing it."""
        if not self._closed:
            self._stop()
            # Some arms get no more commands and store their position, so they must not be swinging.
            end_ns = self._clock.now_ns() + _SWING_NS
            while (now_ns := self._clock.now_ns()) < end_ns:
                if self._cycles:
                    self._cycle()
                self._clock.sleep_until(min(self._due_ns if self._cycles else now_ns + PACE_NS, end_ns))
            self._closed = True
            with suppress(Exception):
                self._arm.close()
        self._line.close()


class Assignment(NamedTuple):
    """Work assigned to the process in its first message; ``path`` is the loop's module search path."""

    entry: DeviceEntry
    context: RigContext
    clock: MonotonicClock
    real_time: RealTimeConfig
    timeout_ns: int
    path: tuple[str, ...]


def _set_priority(real_time: RealTimeConfig) -> None:
    """If the run uses real-time priorities, give this thread a higher priority than the loop's."""
    if real_time.scheduling and not take_real_time(min(real_time.priority + 1, 99)).granted:
        take_real_time(real_time.priority)


def main() -> None:
    """Run the arm process; the arguments are the file descriptors of the connection and the shared memory."""
    # A termination request is for the loop, which ends this process by closing its line.
    ignore_ending_signals()
    line, file = Connection(int(sys.argv[1])), int(sys.argv[2])
    memory = ArmMemory(mmap.mmap(file, ArmMemory.BYTES))
    os.close(file)
    loop, was_left = os.getppid(), True
    with suppress(EOFError, OSError):
        was_left = _serve(Assignment(*line.recv()), line, memory, lambda: os.getppid() != loop)
    if was_left:
        with suppress(OSError):
            sys.stderr.write("palpate: the loop ended unexpectedly; the arm was stopped\n")
    # The process ends immediately, even if an adapter has left threads.
    os._exit(0)


def _serve(given: Assignment, line: Connection, memory: ArmMemory, is_orphan: Callable[[], bool]) -> bool:
    sys.path[:] = given.path
    clock = given.clock
    set_priority = partial(_set_priority, given.real_time)
    set_priority()
    # The priority is between those of the bus's receiver and of this thread.
    sys.setswitchinterval(_SWITCH_S)
    context = replace(given.context, clock=clock, set_priority=set_priority)
    arm = served(arm_maker(given.entry.adapter)(given.entry.settings, context), context)
    with RealTime(replace(given.real_time, scheduling=False, cpu=-1)):
        return ArmLoop(arm, line, memory, clock, given.timeout_ns, is_orphan).serve()


if __name__ == "__main__":
    main()
