"""What the host gave while a test ran against the wall clock."""

import os
import re
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

import pytest

EXCUSED: Final = "the host came late: "
"""How the reason of a skipped test begins that could not judge."""
MOST_EXCUSED: Final = 1 if "PYTEST_XDIST_WORKER" in os.environ else 2
"""More tests than this, of each of two workers, are never excused in one run: then a late host proves nothing more."""
PRIORITY: Final = 20
"""In the real-time class, of tests that ask for it and the probe, where the system grants it."""
_NAP_S: Final = 0.002
_TELL_S: Final = 0.02
_MOST_PROCESSORS: Final = 4
_PROBE: Final = f"""
import os, sys, threading, time

def sleep_and_sleep(kind, processor):
    os.sched_setaffinity(0, {{processor}})
    if kind == "F":
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param({PRIORITY}))
        except OSError:
            pass
    worst, woken = 0.0, time.monotonic()
    told = woken
    while True:
        time.sleep({_NAP_S})
        before, woken = woken, time.monotonic()
        worst = max(worst, woken - before - {_NAP_S})
        if woken - told > {_TELL_S}:
            try:
                os.write(1, f"{{kind}} {{processor}} {{told}} {{woken}} {{worst}}\\n".encode())
            except BrokenPipeError:
                return
            worst, told = 0.0, woken

def begin(kind, processor):
    sleeper = threading.Thread(target=sleep_and_sleep, args=(kind, processor), daemon=True)
    sleeper.start()
    return sleeper

processors = sorted(os.sched_getaffinity(0))[:{_MOST_PROCESSORS}]
sleepers = [begin(kind, processor) for processor in processors for kind in "FO"]
try:
    sleepers[0].join()
except KeyboardInterrupt:
    pass
"""


class LateError(AssertionError):
    """Something did not come about in time; whose fault that is depends on the host."""


class Host:
    """A process beside the tests that sleeps and sleeps, and notes by how much its sleeps were too long.

    It is a process of its own so that it never waits for the interpreter of the test. On each processor, for a virtual
    one may stand still while the others run, one of its threads is scheduled as any process, another in the real-time
    class as the tests that ask for it.
    """

    def __init__(self) -> None:
        self.excused = 0
        self._spans: deque[tuple[str, str, float, float, float]] = deque(maxlen=100_000)
        self._processors = min(len(os.sched_getaffinity(0)), _MOST_PROCESSORS)
        words = [sys.executable, "-I", "-S", "-c", _PROBE]
        self._probe = subprocess.Popen(words, stdout=subprocess.PIPE)
        assert self._probe.stdout is not None
        self._output = self._probe.stdout
        self._reader = threading.Thread(target=self._read, name="host probe", daemon=True)
        self._reader.start()
        self.lateness_s(time.monotonic())  # it sleeps from now on

    def close(self) -> None:
        self._probe.kill()
        self._probe.wait()
        self._reader.join()
        self._output.close()

    def _read(self) -> None:
        for line in self._output:
            kind, processor, began, ended, late = line.decode().split()
            self._spans.append((kind, processor, float(began), float(ended), float(late)))

    def lateness_s(self, since_s: float) -> float:
        """By how much the worst sleep since then was too long, of a thread that is scheduled as this one.

        Args:
            since_s: In the system's monotonic time.
        """
        own = "F" if os.sched_getscheduler(0) == os.SCHED_FIFO else "O"
        now_s = time.monotonic()
        # What it has to tell of this moment comes a little later, and as late as the host makes it.
        while self._told_of(own, now_s) < self._processors:
            if time.monotonic() - now_s > 10.0:
                return 10.0
            time.sleep(_TELL_S)
        return max(
            (late for kind, _, _, ended, late in list(self._spans) if kind == own and ended >= since_s), default=0.0
        )

    def _told_of(self, own: str, since_s: float) -> int:
        """Processors of whose time since then something is known."""
        return len({one for kind, one, began, *_ in list(self._spans) if kind == own and began >= since_s})

    def wait_for(self, condition: Callable[[], object], within_s: float = 10.0) -> None:
        """Wait until something has come about.

        Raises:
            LateError: It has not, in time.
        """
        deadline_s = time.monotonic() + within_s
        while not condition():
            if time.monotonic() > deadline_s:
                raise LateError(f"it did not come about within {within_s} s")
            time.sleep(0.002)

    @contextmanager
    def judged(
        self, allowed_s: float, kind: type[Exception] | tuple[type[Exception], ...] = (), match: str = ""
    ) -> Iterator[None]:
        """What is wrong in here because it came late counts only where the host itself was in time.

        Args:
            allowed_s: Lateness that the code under test has to stand.
            kind: What lateness may bring about, besides :class:`LateError`. A wrong value is never of that kind.
            match: What such an error says, a regular expression.
        """
        begin_s = time.monotonic()
        try:
            yield
        except Exception as error:
            is_kind = isinstance(error, kind) and re.search(match, str(error))
            late_s = self.lateness_s(begin_s)
            by_lateness = isinstance(error, LateError) or is_kind
            if not by_lateness or late_s <= allowed_s or self.excused >= MOST_EXCUSED:
                raise
            self.excused += 1
            pytest.skip(f"{EXCUSED}a plain sleep by {late_s * 1e3:.0f} ms, {allowed_s * 1e3:.0f} allowed: {error}")
