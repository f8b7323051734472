"""What the system did to a thread that did not do its work in time, seen from another thread or process."""

import os
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Final, NamedTuple

_CLOCK_TICK_NS: Final = 1_000_000_000 // os.sysconf("SC_CLK_TCK")
_NOT_KNOWN: Final = "why is not known: the system keeps no account of the loop"


class _Look(NamedTuple):
    """How things stood with a thread at some time.

    Attributes:
        state: As of ``/proc/PID/stat``: R running or ready, S and D waiting, T stopped.
        stolen_ns: What a hypervisor has taken from each processor.
        cpu: The processor on which the thread ran last.
    """

    thread: int
    time_ns: int
    state: str
    run_ns: int
    delay_ns: int
    stolen_ns: Mapping[str, int]
    cpu: str


class LoopAccount:
    """Says whose fault the silence of a loop is."""

    def __init__(self, process: int, proc: Path = Path("/proc")) -> None:
        self._proc, self._tasks = proc, proc / str(process) / "task"
        self._before: _Look | None = None

    def look(self, thread: int) -> None:
        """The time in question begins.

        Args:
            thread: The system's number of the loop's thread.
        """
        self._before = self._look(thread)

    def explanation(self, thread: int) -> str:
        """What became of the thread since the last look, and whose fault that is."""
        before, now = self._before, self._look(thread)
        if now is None:
            return _NOT_KNOWN
        if now.state in "tT":
            return "the loop's process is stopped, by SIGSTOP or Ctrl-Z (the operator's fault)"
        if before is None or before.thread != thread:
            return _NOT_KNOWN
        passed, run = now.time_ns - before.time_ns, now.run_ns - before.run_ns
        # One that still waits for a processor has not been charged for it yet; whoever asks this has one.
        waits_yet = now.state == "R" and thread != threading.get_native_id()
        waited = passed - run if waits_yet else now.delay_ns - before.delay_ns
        # Not every kernel takes off the time in which a hypervisor had the processor.
        stolen = now.stolen_ns[now.cpu] - before.stolen_ns.get(now.cpu, 0)
        waited = min(waited + stolen, passed)
        run = min(run, passed - waited)
        if waited >= max(run, passed - waited - run):
            late = f"{waited * 1e-6:.0f} of the last {passed * 1e-6:.0f} ms"
            return f"this computer was late: it gave the loop no processor for {late} (this computer's fault)"
        if run >= passed - waited - run:
            busy = (
                f"for {run * 1e-6:.0f} of the last {passed * 1e-6:.0f} ms, without a processor for {waited * 1e-6:.0f}"
            )
            return f"the loop was busy with something else {busy} (our software's fault, or that of a package it uses)"
        return "the loop waited for something, a disk, a device or another thread (the fault of whatever it called)"

    def _look(self, thread: int) -> _Look | None:
        task = self._tasks / str(thread)
        try:
            run, delay, _ = (task / "schedstat").read_text().split()
            # The name, in parentheses, may have blanks in it.
            stat = (task / "stat").read_text().rpartition(")")[2].split()
            lines = [line.split() for line in (self._proc / "stat").read_text().splitlines()]
            stolen = {name: int(ticks[7]) * _CLOCK_TICK_NS for name, *ticks in lines if name.startswith("cpu")}
            return _Look(thread, time.monotonic_ns(), stat[0], int(run), int(delay), stolen, "cpu" + stat[36])
        except (OSError, ValueError, IndexError):
            return None
