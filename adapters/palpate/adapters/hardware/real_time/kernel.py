"""The system calls behind real-time behaviour. Nothing is decided here; a refusal is an ``OSError``."""

import ctypes
import errno
import os
from math import inf
from pathlib import Path
from typing import Any, Final

_MCL_CURRENT: Final = 1
_MCL_FUTURE: Final = 2
_MCL_ONFAULT: Final = 4
_CAP_IPC_LOCK: Final = 14
_WAKE_UP: Final = "/dev/cpu_dma_latency"


class Kernel:
    """Linux, for the calling thread and its process. Other systems refuse everything with ``ENOSYS``."""

    def scheduling(self) -> tuple[int, int]:
        """Policy, with its flags, and priority of the calling thread."""
        policy: int = _system("sched_getscheduler")(0)
        return policy, _system("sched_getparam")(0).sched_priority

    def set_scheduling(self, policy: int, priority: int) -> None:
        """Set policy, with its flags, and priority of the calling thread."""
        _system("sched_setscheduler")(0, policy, _system("sched_param")(priority))

    def fifo(self, priority: int, *, inherited: bool = False) -> None:
        """Put the calling thread into ``SCHED_FIFO``, and what it starts from now on if that is to inherit it."""
        # Without the flag every thread and process that is started later would run at this priority too, the
        # writer of the logs for one, and compete with the loop.
        flag = 0 if inherited else _system("SCHED_RESET_ON_FORK")
        self.set_scheduling(_system("SCHED_FIFO") | flag, priority)

    def affinity(self) -> frozenset[int]:
        """CPUs that the calling thread may run on."""
        return frozenset(_system("sched_getaffinity")(0))

    def set_affinity(self, cpus: frozenset[int]) -> None:
        """Let the calling thread run on these CPUs only."""
        _system("sched_setaffinity")(0, cpus)

    def lock_memory(self) -> None:
        """Keep what is, and what will be, in memory there."""
        # On fault: pages stay once they were touched. Otherwise every reserved range (stacks of 8 MiB, arenas of
        # 64 MiB, whole libraries) would be filled at once.
        self._call("mlockall", _MCL_CURRENT | _MCL_FUTURE | _MCL_ONFAULT)

    def unlock_memory(self) -> None:
        """Undo :meth:`lock_memory`."""
        self._call("munlockall")

    def stay_awake(self) -> int:
        """Let no idle processor sleep until :meth:`may_sleep` is called with what this returns."""
        # The kernel's interface for it: no more microseconds than these to wake up in, for as long as the file is open.
        held = os.open(_WAKE_UP, os.O_WRONLY)
        try:
            os.write(held, bytes(4))
        except OSError:
            os.close(held)
            raise
        return held

    def may_sleep(self, held: int) -> None:
        """Undo :meth:`stay_awake`."""
        os.close(held)

    def may_lock_any_amount(self) -> bool:
        """Whether locked memory has no limit: then allocating more can never fail for being locked."""
        return self.memory_limit_bytes() == inf or self._has_capability(_CAP_IPC_LOCK)

    def memory_limit_bytes(self) -> float:
        """Limit of locked memory (``ulimit -l``); infinite without one."""
        return self._limit("RLIMIT_MEMLOCK")

    def priority_limit(self) -> float:
        """Highest real-time priority without privileges (``ulimit -r``); infinite without a limit."""
        return self._limit("RLIMIT_RTPRIO")

    def _limit(self, name: str) -> float:
        try:
            import resource
        except ImportError:
            return 0.0
        if not hasattr(resource, name):
            return 0.0
        soft = resource.getrlimit(getattr(resource, name))[0]
        return inf if soft == resource.RLIM_INFINITY else float(soft)

    def _has_capability(self, number: int) -> bool:
        try:
            lines = Path("/proc/self/status").read_text().splitlines()
            held = next(int(line.split()[1], 16) for line in lines if line.startswith("CapEff:"))
        except (OSError, StopIteration, ValueError):
            return False
        return bool(held >> number & 1)

    def _call(self, name: str, *arguments: int) -> None:
        try:
            function = getattr(ctypes.CDLL(None, use_errno=True), name)
        except (OSError, TypeError, AttributeError) as error:
            raise _missing(name) from error
        if function(*arguments):
            number = ctypes.get_errno()
            raise OSError(number, os.strerror(number))


def _system(name: str) -> Any:
    """What only some systems have."""
    try:
        return getattr(os, name)
    except AttributeError as error:
        raise _missing(name) from error


def _missing(name: str) -> OSError:
    return OSError(errno.ENOSYS, f"this system has no {name}")
