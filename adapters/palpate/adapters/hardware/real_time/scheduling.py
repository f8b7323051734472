"""Request real-time scheduling from the operating system, report the results, and restore all settings afterwards."""

import ctypes
import gc
import os
import resource
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from functools import partial
from typing import Final, NamedTuple, Self, TypeAlias

from palpate.adapters.config import RealTimeConfig

_Taking: TypeAlias = Callable[[], AbstractContextManager[None]]
_SWITCH_S: Final = 0.0001
"""Time after which the loop requests the interpreter from another thread. Python's default is 5 ms."""
_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4
_SCHEDULING_REMEDY: Final = (
    "add a line '@realtime - rtprio 51' to /etc/security/limits.d and log in again; a container needs"
    " --cap-add=SYS_NICE"
)
_CPU_REMEDY: Final = "choose a CPU that this process may use"
_MEMORY_WISH: Final = "memory that is never paged out (mlockall)"
_MEMORY_REMEDY: Final = (
    "add a line '@realtime - memlock unlimited' to /etc/security/limits.d and log in again; a container needs"
    " --ulimit memlock=-1"
)


class RealTimeResult(NamedTuple):
    """Result of a request. A denied request has a reason and is not an error."""

    wish: str
    reason: str = ""

    @property
    def granted(self) -> bool:
        """True if the system granted the request."""
        return not self.reason

    def __str__(self) -> str:
        return f"granted: {self.wish}" if self.granted else f"refused: {self.wish}: {self.reason}"


class RealTime:
    """Real-time resources for a run. Use it as a context manager around the run, and :meth:`loop` around each trial.

    Locked memory and frozen objects belong to the process and last as long as the run. Priority and CPU belong to the
    loop's thread and last as long as :meth:`loop`, so a process started outside it inherits neither. A bus thread
    requests both with :func:`join_loop`.
    """

    def __init__(self, config: RealTimeConfig) -> None:
        self._config = config
        self._of_run = ExitStack()
        self._of_loop: list[_Taking] = []
        self.request_results: tuple[RealTimeResult, ...] = ()

    def __enter__(self) -> Self:
        config, request_results = self._config, []
        if config.scheduling:
            take: _Taking = partial(_fifo, config.priority)
            request_results.append(_attempt(_scheduling(config.priority), _SCHEDULING_REMEDY, partial(self._try, take)))
        if config.cpu >= 0:
            take = partial(_pinned, config.cpu)
            request_results.append(
                _attempt(f"the loop on CPU {config.cpu} alone", _CPU_REMEDY, partial(self._try, take))
            )
        if config.lock_memory:
            request_results.append(
                _attempt(_MEMORY_WISH, _MEMORY_REMEDY, partial(self._of_run.enter_context, _locked_memory()))
            )
        if config.freeze_objects:
            gc.collect()
            gc.freeze()
            self._of_run.callback(gc.unfreeze)
            request_results.append(RealTimeResult("objects of the start exempt from garbage collection"))
        self.request_results = tuple(request_results)
        return self

    def __exit__(self, *_: object) -> None:
        self._of_loop.clear()
        self._of_run.close()

    @contextmanager
    def loop(self) -> Iterator[None]:
        """Set the priority and the CPU of the trial's thread within the context, if they were granted.

        Other threads must release the interpreter sooner, because priority does not help a loop waiting for it.
        """
        with ExitStack() as opened:
            opened.callback(sys.setswitchinterval, sys.getswitchinterval())
            sys.setswitchinterval(_SWITCH_S)
            for take in self._of_loop:
                opened.enter_context(take())
            yield

    def _try(self, take: _Taking) -> None:
        """Test a request by taking the resource and giving it back. :meth:`loop` takes those that were granted."""
        with take():
            self._of_loop.append(take)


def take_real_time(priority: int) -> RealTimeResult:
    """Permanently put this thread and all threads that it starts into the real-time class, at priority 1 to 99."""
    take = partial(os.sched_setscheduler, 0, os.SCHED_FIFO, os.sched_param(priority))
    return _attempt(_scheduling(priority), _SCHEDULING_REMEDY, take)


def join_loop(config: RealTimeConfig) -> None:
    """Permanently give this thread the loop's CPU and real-time class, if the run requests them.

    The loop may wait for such a thread, which on another CPU could hold the interpreter without running. A denial is
    reported only for the loop.
    """
    if config.cpu >= 0:
        with suppress(OSError, AttributeError):
            os.sched_setaffinity(0, {config.cpu})
    if config.scheduling:
        take_real_time(config.priority)


def _scheduling(priority: int) -> str:
    return f"real-time scheduling (SCHED_FIFO) at priority {priority}"


def _attempt(wish: str, remedy: str, take: Callable[[], object]) -> RealTimeResult:
    try:
        take()
    except (OSError, ValueError, AttributeError) as error:
        # AttributeError: this system has no such call.
        return RealTimeResult(wish, f"{getattr(error, 'strerror', None) or error}; {remedy}")
    return RealTimeResult(wish)


@contextmanager
def _fifo(priority: int) -> Iterator[None]:
    policy, parameter = os.sched_getscheduler(0), os.sched_getparam(0)
    # With the flag, a process started meanwhile does not compete with the loop. Without privileges the flag cannot be
    # removed, but it does no harm.
    os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    try:
        yield
    finally:
        os.sched_setscheduler(0, policy | os.SCHED_RESET_ON_FORK, parameter)


@contextmanager
def _pinned(cpu: int) -> Iterator[None]:
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {cpu})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


@contextmanager
def _locked_memory() -> Iterator[None]:
    # Below a limit the call itself may succeed and a later allocation fail in the middle of a trial.
    unlimited = resource.RLIM_INFINITY
    if resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] != unlimited:
        resource.setrlimit(resource.RLIMIT_MEMLOCK, (unlimited, unlimited))
    libc = ctypes.CDLL(None, use_errno=True)
    # On fault: pages stay locked once they have been touched. Otherwise every reserved range would be filled at once.
    if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE | _MCL_ONFAULT):
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    try:
        yield
    finally:
        libc.munlockall()
