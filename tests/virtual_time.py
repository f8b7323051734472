"""One clock that no wall clock moves: threads take turns, emulated devices live between them, nobody waits for real.

Time goes on only while every thread sleeps, and then by as much as it takes to the next thing that happens: a device
that has something to do, or a thread whose sleep is over. A test gives the same at each run, however busy the computer.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass

from palpate.core.ports.devices import Clock


@dataclass(slots=True)
class _Sleeper:
    deadline_ns: int
    awaited: Callable[[], bool] | None


class VirtualTime(Clock):
    """The run's clock of a test.

    Attributes:
        devices: What lives in it: next_event_ns() says when it next has something to do, step(now_ns) does it.

    Args:
        guests: How the names of the threads end that the code under test starts and that live by this clock.
    """

    def __init__(self, guests=" bus"):
        self.devices = []
        self._guests = guests
        self._now_ns = 1_000_000
        self._arrivals = threading.Condition()
        self._turn = threading.current_thread()
        # A condition each: all others sleep on when one of them has its turn.
        self._known = {self._turn: threading.Condition(self._arrivals)}
        self._sleepers = {}

    def now_ns(self):
        """See :class:`Clock`; a thread that asks for the first time waits for its turn."""
        if threading.current_thread() not in self._known:
            self.sleep_until(0)
        return self._now_ns

    def sleep_until(self, deadline_ns):
        """See :class:`Clock`."""
        self.wait_for(None, deadline_ns)

    def sleep(self, seconds):
        """Sleep for a while."""
        self.sleep_until(self.now_ns() + round(seconds * 1e9))

    def wait_for(self, awaited, deadline_ns):
        """Sleep until something has come about, at most until the deadline; returns whether it has."""
        me = threading.current_thread()
        with self._arrivals:
            if me not in self._known:
                self._known[me] = threading.Condition(self._arrivals)
            self._sleepers[me] = _Sleeper(deadline_ns, awaited)
            if self._turn == me:
                self._pass_on()
            else:
                self._arrivals.notify_all()
            while self._turn != me:
                # Only a thread that has ended passes its turn on to nobody.
                self._known[me].wait(0.005)
                if self._turn != me and not self._turn.is_alive():
                    self._pass_on()
            del self._sleepers[me]
        return awaited is not None and awaited()

    def _pass_on(self):
        """Let time go on to the next thread's turn."""
        while self._has_newcomers():
            self._arrivals.wait(0.001)
        while True:
            due_ns, _, thread = min((self._due_ns(thread), k, thread) for k, thread in enumerate(self._sleepers))
            events_ns = [device.next_event_ns() for device in self.devices]
            event_ns = min(events_ns, default=due_ns + 1)
            if event_ns > due_ns:
                self._now_ns = max(self._now_ns, due_ns)
                self._turn = thread
                self._known[thread].notify()
                return
            self._now_ns = max(self._now_ns, event_ns)
            self.devices[events_ns.index(event_ns)].step(self._now_ns)

    def _due_ns(self, thread):
        sleeper = self._sleepers[thread]
        return self._now_ns if sleeper.awaited is not None and sleeper.awaited() else sleeper.deadline_ns

    def _has_newcomers(self):
        return any(thread.name.endswith(self._guests) and thread not in self._known for thread in threading.enumerate())


class Timer:
    """Calls things later."""

    def __init__(self, clock):
        self._clock, self._jobs = clock, list[tuple[int, Callable[[], object]]]()
        clock.devices.append(self)

    def after(self, wait_ns, call):
        """Call it so much later."""
        self._jobs.append((self._clock.now_ns() + wait_ns, call))

    def next_event_ns(self):
        return min((due_ns for due_ns, _ in self._jobs), default=1 << 62)

    def step(self, now_ns):
        due = [job for job in self._jobs if job[0] <= now_ns]
        self._jobs = [job for job in self._jobs if job[0] > now_ns]
        for _, call in due:
            call()


class VirtualCondition:
    """A condition variable of code that lives by that clock; it needs no lock, because one thread runs at a time."""

    def __init__(self, clock):
        self._clock, self._notified = clock, 0

    def __enter__(self):
        pass

    def __exit__(self, *_):
        pass

    def wait(self, timeout_s):
        before, end_ns = self._notified, self._clock.now_ns() + max(1, round(timeout_s * 1e9))
        self._clock.wait_for(lambda: self._notified > before, end_ns)

    def notify_all(self):
        self._notified += 1
