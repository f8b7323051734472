"""Signals that end a process: one list for the process that commands an arm and for those that work for it."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

ENDING: Final = (
    signal.SIGHUP, signal.SIGINT, signal.SIGQUIT, signal.SIGUSR1, signal.SIGUSR2, signal.SIGALRM, signal.SIGTERM,
    signal.SIGSTKFLT, signal.SIGXCPU, signal.SIGVTALRM, signal.SIGPROF, signal.SIGIO, signal.SIGPWR,
    *range(signal.SIGRTMIN, signal.SIGRTMAX + 1),
)  # fmt: skip
"""Signals that end a process by default and can be caught.

Not those of a crash (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP, SIGSYS), after which no code can be trusted,
and not SIGPIPE and SIGXFSZ, which Python turns into an OSError.
"""
_ALWAYS: Final = (signal.SIGINT, signal.SIGTERM)


class _Handler:
    """A handler of this module, which a later one may replace."""

    def __init__(self, act: Callable[[int], None]) -> None:
        self._act = act

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self._act(number)


@contextmanager
def on_ending_signal(act: Callable[[int], None], *, always: bool = True) -> Iterator[None]:
    """While inside, signals that would end the process call ``act`` with their number instead.

    Signals that are ignored, as SIGHUP under ``nohup``, and those that another handler serves keep their meaning,
    except SIGINT and SIGTERM. Python runs handlers in its main thread only: in any other thread this does nothing.
    With ``always``, they are taken also where they are ignored or another handler serves them.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handler = _Handler(act)
    before = {}
    for number in ENDING:
        current = signal.getsignal(number)
        if current is signal.SIG_DFL or isinstance(current, _Handler) or (always and number in _ALWAYS):
            before[number] = signal.signal(number, handler)
    try:
        yield
    finally:
        # Another thread, in which the garbage collector may close its owner, can set no handler.
        here = threading.current_thread() is threading.main_thread()
        for number, previous in before.items() if here else ():
            # Interrupted on its way here, this may come late: a handler that was set since stays.
            if signal.getsignal(number) is handler:
                signal.signal(number, previous)


def ignore_ending_signals() -> None:
    """Leave them to the process that started this one; it ends this process by closing its input."""
    for number in ENDING:
        signal.signal(number, signal.SIG_IGN)
