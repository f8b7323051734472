"""Whose fault a late tick is, by the kernel's own accounts."""

from __future__ import annotations

import enum
import os
import time
from dataclasses import dataclass
from typing import NamedTuple, Self


class Cause(enum.Enum):
    """What made a tick late, for the most part."""

    OWN_WORK = "own work"
    """The loop was still busy: the core, a port that took long, the recorder."""
    NO_CPU = "no processor free"
    """The loop was ready to run, and the system ran something else."""
    TAKEN = "processor taken away"
    """The loop was at work, and a hypervisor or an interrupt had its processor."""
    WOKEN_LATE = "woken late"
    """Neither: a timer, an interrupt or a hypervisor that came late."""
    UNKNOWN = "not known"
    """The system keeps no accounts that tell."""


@dataclass(frozen=True, slots=True)
class Attribution:
    """How the lateness of a tick is made up; the four add up to it.

    Attributes:
        cause: The largest of them.
        own_ns: Own work past the deadline.
        no_cpu_ns: Ready to run, without a processor.
        taken_ns: At work, as far as this system knows, on a processor that did something else.
        woken_late_ns: What none of them explains.
    """

    cause: Cause
    own_ns: int
    no_cpu_ns: int
    taken_ns: int
    woken_late_ns: int


def attribute(late_ns: int, at_work_ns: int, run_delay_ns: int, taken_ns: int = 0) -> Attribution:
    """Share out the lateness of a tick.

    The kernel's accounts come first, because they are exact; own work explains at most what is left.

    Args:
        late_ns: How late the tick began.
        at_work_ns: How much of the time after the deadline the loop was still at work.
        run_delay_ns: How long the thread waited for a processor meanwhile.
        taken_ns: For how long its processor did something else while it was at work.
    """
    no_cpu = min(late_ns, max(run_delay_ns, 0))
    at_work = min(late_ns - no_cpu, max(at_work_ns, 0))
    taken = min(at_work, max(taken_ns, 0))
    own, rest = at_work - taken, late_ns - no_cpu - at_work
    shares = {Cause.OWN_WORK: own, Cause.NO_CPU: no_cpu, Cause.TAKEN: taken, Cause.WOKEN_LATE: rest}
    return Attribution(max(shares, key=lambda cause: shares[cause]), own, no_cpu, taken, rest)


class Account(NamedTuple):
    """What the kernel has kept of a thread since it began.

    Attributes:
        run_ns: Processor time used; without what interrupts and a hypervisor took, where the kernel knows of it.
        delay_ns: Time spent ready without a processor.
        turns: How often it was given a processor.
    """

    run_ns: int
    delay_ns: int
    turns: int


class ThreadAccount:
    """The kernel's account of the calling thread. Made and read by one and the same thread.

    Raises:
        OSError: The system keeps none.
    """

    def __init__(self) -> None:
        self._file = os.open("/proc/thread-self/schedstat", os.O_RDONLY | os.O_CLOEXEC)
        try:
            self.read()
        except (OSError, ValueError) as error:
            self.close()
            raise OSError("schedstat cannot be read") from error

    @classmethod
    def if_kept(cls) -> Self | None:
        """The account, or None where the system keeps none."""
        try:
            return cls()
        except OSError:
            return None

    def read(self) -> Account:
        """The account up to now."""
        _, delay, turns = os.pread(self._file, 96, 0).split()
        # The file's own run time is brought up to date only now and then; the thread's clock always is.
        return Account(time.thread_time_ns(), int(delay), int(turns))

    def close(self) -> None:
        """Close the file; allowed twice."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
