"""Asks the operating system for real-time behaviour, says what came of it, and gives everything back."""

import gc
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Final, Self

from palpate.adapters.config import FROZEN, OFF, RealTimeConfig
from palpate.adapters.hardware.real_time.kernel import Kernel

# How long the loop waits before it asks another thread for the interpreter; by default Python waits 5 ms.
_SWITCH_S: Final = 0.0001


@dataclass(frozen=True, slots=True)
class Grant:
    """What became of one request to the operating system: granted or refused; a refusal is no error.

    Attributes:
        reason: Why not; empty when granted.
        remedy: What would help; empty when granted.
    """

    wish: str
    granted: bool
    reason: str = ""
    remedy: str = ""

    def __str__(self) -> str:
        if self.granted:
            return f"granted: {self.wish}"
        return f"refused: {self.wish}: {self.reason}; {self.remedy}"


class RealTime:
    """What a run gets from the system. A context manager around the run; :meth:`loop` goes around each trial.

    Memory and frozen objects belong to the process, hence to the run, and idle processors stay awake for as long.
    Priority and CPU belong to the loop's thread and are held within :meth:`loop` only, so that whatever is started
    outside of it (the log's writer, watchdogs) inherits neither; the thread of a bus asks for both with
    :func:`join_loop`. For what is started within, priority is reset by the kernel (``SCHED_RESET_ON_FORK``); there is
    no such flag for the CPU, so nothing should be started there with one.
    """

    def __init__(self, config: RealTimeConfig, kernel: Kernel | None = None) -> None:
        self._config, self._kernel = config, kernel or Kernel()
        self._stack = ExitStack()
        self._priority_granted = self._cpu_granted = False
        self.grants: tuple[Grant, ...] = ()

    def __enter__(self) -> Self:
        config = self._config
        grants: list[Grant] = []
        with ExitStack() as stack:
            if config.scheduling:
                grants.append(self._try_scheduling())
                self._priority_granted = grants[-1].granted
            if config.cpu >= 0:
                grants.append(self._try_cpu())
                self._cpu_granted = grants[-1].granted
            if config.lock_memory:
                grants.append(self._lock_memory(stack))
            if config.stay_awake:
                grants.append(self._stay_awake(stack))
            if config.garbage_collection in (FROZEN, OFF):
                # Also without collections in trials: those between them would hold up the threads of buses.
                gc.collect()
                gc.freeze()
                stack.callback(gc.unfreeze)
                grants.append(Grant("objects of the start are exempt from garbage collection", True))
            if config.garbage_collection == OFF:
                grants.append(Grant("garbage is collected between trials only", True))
            self._stack = stack.pop_all()
        self.grants = tuple(grants)
        return self

    def __exit__(self, *_: object) -> None:
        self._priority_granted = self._cpu_granted = False
        self._stack.close()

    @contextmanager
    def loop(self) -> Iterator[None]:
        """Around a trial, in the thread that runs it: priority and CPU as granted, garbage left alone if so asked.

        Other threads of this process must let go of the interpreter sooner than they usually do, for no priority helps
        a loop that waits for it.
        """
        with ExitStack() as stack:
            stack.callback(sys.setswitchinterval, sys.getswitchinterval())
            sys.setswitchinterval(_SWITCH_S)
            if self._config.garbage_collection == OFF and gc.isenabled():
                # Undone last, after the thread is an ordinary one again: a whole collection takes a while.
                stack.callback(gc.collect)
                stack.callback(gc.enable)
                gc.disable()
            if self._cpu_granted:
                self._pin(stack)
            if self._priority_granted:
                self._raise_priority(stack)
            yield

    def _try_scheduling(self) -> Grant:
        priority = self._config.priority
        return _ask(_wish(priority), _remedy(priority, self._kernel), self._raise_priority)

    def _try_cpu(self) -> Grant:
        wish = f"the loop on CPU {self._config.cpu} alone"
        try:
            allowed = ", ".join(map(str, sorted(self._kernel.affinity())))
        except OSError as error:
            return Grant(wish, False, _words(error), "leave real_time.cpu at -1 on this system")
        remedy = f"choose one that this process may use: {allowed}"
        return _ask(wish, remedy, self._pin)

    def _lock_memory(self, stack: ExitStack) -> Grant:
        wish = "memory that is never paged out (mlockall)"
        remedy = (
            "grant CAP_IPC_LOCK, or lift the limit: a line '@realtime - memlock unlimited' in /etc/security/limits.d,"
            " then log in anew; a container needs --cap-add=IPC_LOCK"
        )
        if not self._kernel.may_lock_any_amount():
            # The call itself might succeed now, and some later allocation fail for the limit in mid-trial.
            limit = self._kernel.memory_limit_bytes()
            return Grant(wish, False, f"only {limit / 1024:g} KiB may be locked (ulimit -l)", remedy)
        try:
            self._kernel.lock_memory()
        except OSError as error:
            return Grant(wish, False, _words(error), remedy)
        stack.callback(_unless_refused, self._kernel.unlock_memory)
        return Grant(wish, True)

    def _stay_awake(self, stack: ExitStack) -> Grant:
        wish = "idle processors that stay awake"
        try:
            held = self._kernel.stay_awake()
        except OSError as error:
            remedy = "allow this user to write /dev/cpu_dma_latency (a udev rule); a container needs --device"
            return Grant(wish, False, _words(error), remedy)
        stack.callback(_unless_refused, lambda: self._kernel.may_sleep(held))
        return Grant(wish, True)

    def _raise_priority(self, stack: ExitStack) -> None:
        policy, priority = self._kernel.scheduling()
        self._kernel.fifo(self._config.priority)
        stack.callback(self._lower_priority, policy, priority)

    def _lower_priority(self, policy: int, priority: int) -> None:
        try:
            self._kernel.set_scheduling(policy, priority)
        except OSError:
            # Without the privilege the flag that resets on fork cannot be taken off; it does no harm.
            now, _ = self._kernel.scheduling()
            flags = now & ~0xFF
            _unless_refused(lambda: self._kernel.set_scheduling(policy | flags, priority))

    def _pin(self, stack: ExitStack) -> None:
        before = self._kernel.affinity()
        self._kernel.set_affinity(frozenset((self._config.cpu,)))
        stack.callback(_unless_refused, lambda: self._kernel.set_affinity(before))


def request(config: RealTimeConfig, kernel: Kernel | None = None) -> list[Grant]:
    """Ask for everything once and give it back: what the system would grant to a run. Never raises for a refusal."""
    with RealTime(config, kernel) as real_time:
        return list(real_time.grants)


def take_real_time(priority: int, kernel: Kernel | None = None) -> Grant:
    """Put this thread into the real-time class for good, and with it all that it starts from now on.

    Args:
        priority: 1 to 99.
    """
    kernel = kernel or Kernel()
    try:
        kernel.fifo(priority, inherited=True)
    except OSError as error:
        return Grant(_wish(priority), False, _words(error), _remedy(priority, kernel))
    return Grant(_wish(priority), True)


def join_loop(config: RealTimeConfig, kernel: Kernel | None = None) -> None:
    """Put this thread for good where the loop runs, as far as the run asks for it: its CPU and its real-time class.

    For a thread that the loop must wait for, since both need the interpreter. On another CPU it may be kept from
    running, by a hypervisor or by an interrupt, while it holds the interpreter and the loop's own CPU is free. What is
    refused here is refused to the loop as well, and told there.
    """
    kernel = kernel or Kernel()
    if config.cpu >= 0:
        _unless_refused(lambda: kernel.set_affinity(frozenset((config.cpu,))))
    if config.scheduling:
        take_real_time(config.priority, kernel)


def _wish(priority: int) -> str:
    return f"real-time scheduling (SCHED_FIFO) at priority {priority}"


def _remedy(priority: int, kernel: Kernel) -> str:
    return (
        f"grant CAP_SYS_NICE, or allow it to this user (ulimit -r is {kernel.priority_limit():g}): a line '@realtime -"
        f" rtprio {priority}' in /etc/security/limits.d, then log in anew; a container needs --cap-add=SYS_NICE"
    )


def _ask(wish: str, remedy: str, take: Callable[[ExitStack], None]) -> Grant:
    """Take it and give it back at once."""
    with ExitStack() as stack:
        try:
            take(stack)
        except OSError as error:
            return Grant(wish, False, _words(error), remedy)
    return Grant(wish, True)


def _words(error: OSError) -> str:
    return (error.strerror or str(error)).lower()


def _unless_refused(call: Callable[[], None]) -> None:
    """For what must not end a run: giving back, which would hide what did end it, and what is told elsewhere."""
    try:
        call()
    except OSError:
        return
