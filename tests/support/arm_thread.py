"""The arm's loop in a thread instead of a process of its own: for virtual time, and for emulators in this process."""

import mmap
import multiprocessing
import threading

from palpate.adapters.hardware.arm_client import ArmClient
from palpate.adapters.hardware.arm_memory import ArmMemory
from palpate.adapters.hardware.arm_process import PACE_NS, ArmLoop

_END_NS = 12 * 10**9


class ArmThread:
    """Takes the place of an ``ArmProcess``."""

    def __init__(self, arm, clock, timeout_ns):
        self.line, theirs = multiprocessing.Pipe()
        memory = mmap.mmap(-1, ArmMemory.BYTES)
        self.memory, self._clock = ArmMemory(memory), clock
        # A board knows which note it has written or read last: each side has its own.
        self.loop = ArmLoop(arm, theirs, ArmMemory(memory), clock, timeout_ns)
        self._thread = threading.Thread(target=self.loop.serve, name=f"{arm.name} bus", daemon=True)
        self._thread.start()

    def is_alive(self):
        return self._thread.is_alive()

    def end(self):
        self.line.close()
        deadline_ns = self._clock.now_ns() + _END_NS
        while self._thread.is_alive() and self._clock.now_ns() < deadline_ns:
            self._clock.sleep_until(self._clock.now_ns() + PACE_NS)

    def kill(self):
        self.line.close()
        return "has ended"


def arm_in_thread(arm, clock, timeout_ns):
    """The arm's ports, over a thread of this process."""
    return ArmClient(arm, lambda: ArmThread(arm, clock, timeout_ns), clock, timeout_ns)
