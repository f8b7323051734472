"""Whose fault a late tick is, by the kernel's own accounts."""

from __future__ import annotations

import enum
import os
import time
from dataclasses import dataclass
from typing import Self


class Cause(enum.Enum):
    """What made a tick late, for the most part."""

    OWN_WORK = "own work"
    """The loop was still busy: the core, a port that took long, the recorder."""
    NO_CPU = "no processor free"
    """The loop was ready to run, and the system ran something else."""
    WOKEN_LATE = "woken late"
    """Neither: a timer, an interrupt or a hypervisor that came late."""
    UNKNOWN = "not known"
    """The system keeps no accounts that tell."""


@dataclass(frozen=True, slots=True)
class Attribution:
    """How the lateness of a tick is made up; the three add up to it.

    Attributes:
        cause: The largest of them.
        own_ns: Own work past the deadline.
        no_cpu_ns: Ready to run, without a processor.
        woken_late_ns: What neither explains.
    """

    cause: Cause
    own_ns: int
    no_cpu_ns: int
    woken_late_ns: int


def attribute(late_ns: int, own_run_ns: int, run_delay_ns: int) -> Attribution:
    """Share out the lateness of a tick.

    The kernel's run delay comes first, because it is exact; own work explains at most what is left.

    Args:
        late_ns: How late the tick began.
        own_run_ns: How much of the time after the deadline the loop was still at work.
        run_delay_ns: How long the thread waited for a processor meanwhile.
    """
    no_cpu = min(late_ns, max(run_delay_ns, 0))
    own = min(late_ns - no_cpu, max(own_run_ns, 0))
    rest = late_ns - no_cpu - own
    shares = {Cause.OWN_WORK: own, Cause.NO_CPU: no_cpu, Cause.WOKEN_LATE: rest}
    return Attribution(max(shares, key=lambda cause: shares[cause]), own, no_cpu, rest)


class ThreadAccount:
    """The kernel's account of the calling thread. Made and read by one and the same thread.

    Raises:
        OSError: The system keeps none.
    """

    def __init__(self) -> None:
        self._file = os.open("/proc/thread-self/schedstat", os.O_RDONLY | os.O_CLOEXEC)
        try:
            self.read()
        except (OSError, ValueError, IndexError) as error:
            self.close()
            raise OSError("schedstat cannot be read") from error

    @classmethod
    def if_kept(cls) -> Self | None:
        """The account, or None where the system keeps none."""
        try:
            return cls()
        except OSError:
            return None

    def read(self) -> tuple[int, int]:
        """Processor time used, and time spent ready without a processor, both since the thread began, ns."""
        # The file's own run time is brought up to date only now and then; the thread's clock always is.
        return time.thread_time_ns(), int(os.pread(self._file, 96, 0).split()[1])

    def close(self) -> None:
        """Close the file; allowed twice."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
