"""Whose fault a late tick is, by the kernel's own accounts."""

import enum
import os
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, Self


class Cause(enum.Enum):
    """What made a tick late, for the most part."""

    OWN_WORK = "own work"
    """The loop was still busy: the core, a port, the recorder."""
    WAITED = "waited"
    """The loop was not done, or had woken, and waited: for a device, or for a thread that held the interpreter."""
    NO_CPU = "no processor free"
    """The loop was ready to run, and the system ran something else."""
    TAKEN = "processor taken away"
    """The loop was at work, and a hypervisor or an interrupt had its processor."""
    WOKEN_LATE = "woken late"
    """None of these: a timer, an interrupt or a hypervisor that came late."""
    UNKNOWN = "not known"
    """The system keeps no accounts that tell."""


@dataclass(frozen=True, slots=True)
class Attribution:
    """How the lateness of a tick is made up.

    Attributes:
        shares_ns: What each cause has to do with it; they add up to it.
    """

    shares_ns: Mapping[Cause, int]

    @property
    def cause(self) -> Cause:
        """The one with the largest share; of equal ones the first to be named."""
        return max(self.shares_ns, key=lambda cause: self.shares_ns[cause])

    def __str__(self) -> str:
        return ", ".join(f"{cause.value} {ns * 1e-6:.2f} ms" for cause, ns in self.shares_ns.items() if ns)


def attribute(late_ns: int, claims: Iterable[tuple[Cause, int]]) -> Attribution:
    """Share out the lateness of a tick.

    Args:
        claims: Causes and how long each of them lasted, ns, the surest first: each explains at most what those before
            it have left. What is left in the end is a thread that was woken late.
    """
    shares: dict[Cause, int] = {}
    left = late_ns
    for cause, lasted_ns in (*claims, (Cause.WOKEN_LATE, late_ns)):
        share = min(left, max(lasted_ns, 0))
        shares[cause] = shares.get(cause, 0) + share
        left -= share
    return Attribution(shares)


class Account(NamedTuple):
    """What the kernel has kept of a thread since it began.

    Attributes:
        run_ns: Processor time used; without what interrupts and a hypervisor took, where the kernel counts it.
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
