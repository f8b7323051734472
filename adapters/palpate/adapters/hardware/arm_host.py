"""Client side of the arm process."""

import mmap
import multiprocessing
import os
import signal
import subprocess
import sys
from contextlib import suppress
from typing import Final

from palpate.adapters.hardware.arm_memory import ArmMemory
from palpate.adapters.hardware.arm_process import Assignment
from palpate.core.errors import DeviceError

_END_S: Final = 12.0
"""Maximum time to wait for the process to end: twice the time needed to stop and close an arm on a dead line."""


class ArmProcess:
    """A new process, which starts work once it receives its assignment."""

    def __init__(self, assignment: Assignment) -> None:
        self.line, theirs = multiprocessing.Pipe()
        file = os.memfd_create("palpate arm")
        handed = (theirs.fileno(), file)
        words = ["-P", "-m", "palpate.adapters.hardware.arm_process", *map(str, handed)]
        try:
            os.ftruncate(file, ArmMemory.BYTES)
            # In a separate process group: Ctrl-C and Ctrl-Z affect the loop, and this process stops the arm after both.
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

    def is_alive(self) -> bool:
        """Return True if the process is running."""
        return self._process.poll() is None

    def end(self) -> None:
        """End the process, after giving it a short time to exit on its own."""
        self.line.close()
        try:
            self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self.kill()

    def kill(self) -> str:
        """Kill the process, and return a description of how it ended, for use in a message."""
        self.line.close()
        with suppress(subprocess.TimeoutExpired):
            # A process that has closed its line is about to end.
            self._process.wait(0.05)
        if self._process.poll() is None:
            self._process.kill()
        code = self._process.wait()
        return f"was killed by {signal.Signals(-code).name}" if code < 0 else f"has ended with code {code}"
