"""What runs an arm's loop: a process of its own, or a thread of this one."""

import mmap
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
from abc import abstractmethod
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Final, Protocol

from typing_extensions import override

from palpate.adapters.hardware.arm_memory import ArmMemory
from palpate.adapters.hardware.arm_process import PACE_NS, ArmLoop, Assignment
from palpate.adapters.hardware.served_arm import ServedArm
from palpate.core.errors import DeviceError
from palpate.core.ports import Clock

_NS: Final = 1_000_000_000
_END_NS: Final = 12 * _NS
"""Longest wait for the process to end: what it takes to stop and close an arm whose line is dead, twice over."""


class ArmHost(Protocol):
    """What runs the :class:`ArmLoop`, as far as its client has to do with it."""

    line: Connection
    memory: ArmMemory

    @abstractmethod
    def is_alive(self) -> bool:
        """Whether it runs."""

    @abstractmethod
    def end(self) -> None:
        """See to it that nothing of it is left; waits a little for it to end by itself."""

    @abstractmethod
    def kill(self) -> str:
        """End it at once; returns how it came to its end, for a message."""


class ArmProcess(ArmHost):
    """The process, just started. It works once it has got its assignment."""

    def __init__(self, assignment: Assignment) -> None:
        self.line, theirs = multiprocessing.Pipe()
        file = os.memfd_create("palpate arm")
        handed = (theirs.fileno(), file)
        words = ["-P", "-m", "palpate.adapters.hardware.arm_process", *map(str, handed)]
        try:
            os.ftruncate(file, ArmMemory.BYTES)
            # In a process group of its own: Ctrl-C and Ctrl-Z are for the loop, and this stops the arm after both.
            self._process = subprocess.Popen(
                [sys.executable, *words], stdin=subprocess.DEVNULL, pass_fds=handed, process_group=0
            )
            self.memory = ArmMemory(mmap.mmap(file, ArmMemory.BYTES))
        except OSError as error:
            self.line.close()
            raise DeviceError("arm", f"its process cannot be started ({error.strerror})") from error
        finally:
            theirs.close()
            os.close(file)
        with suppress(OSError):
            self.line.send(assignment)

    @override
    def is_alive(self) -> bool:
        return self._process.poll() is None

    @override
    def end(self) -> None:
        self.line.close()
        try:
            self._process.wait(_END_NS / _NS)
        except subprocess.TimeoutExpired:
            self.kill()

    @override
    def kill(self) -> str:
        self.line.close()
        with suppress(subprocess.TimeoutExpired):
            # One that has hung up is about to end.
            self._process.wait(0.05)
        if self._process.poll() is None:
            self._process.kill()
        code = self._process.wait()
        return f"was killed by {signal.Signals(-code).name}" if code < 0 else f"has ended with code {code}"


class ArmThread(ArmHost):
    """The same in a thread of this process."""

    def __init__(self, arm: ServedArm, clock: Clock, timeout_ns: int) -> None:
        self.line, theirs = multiprocessing.Pipe()
        memory = mmap.mmap(-1, ArmMemory.BYTES)
        self.memory, self._clock = ArmMemory(memory), clock
        # A board knows which note it has written or read last: each side has its own.
        self.loop = ArmLoop(arm, theirs, ArmMemory(memory), clock, timeout_ns)
        self._thread = threading.Thread(target=self.loop.serve, name=f"{arm.name} bus", daemon=True)
        self._thread.start()

    @override
    def is_alive(self) -> bool:
        return self._thread.is_alive()

    @override
    def end(self) -> None:
        self.line.close()
        deadline_ns = self._clock.now_ns() + _END_NS
        while self._thread.is_alive() and self._clock.now_ns() < deadline_ns:
            self._clock.sleep_until(self._clock.now_ns() + PACE_NS)

    @override
    def kill(self) -> str:
        self.line.close()
        return "has ended"
