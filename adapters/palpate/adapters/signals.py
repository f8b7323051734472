"""Signals that end a process, shared by the process that commands an arm and its helper processes."""

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

Not included: crash signals (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP, SIGSYS), after which no code can be
trusted; SIGPIPE and SIGXFSZ, which Python turns into an OSError.
"""
_ALWAYS: Final = (signal.SIGINT, signal.SIGTERM)


class _Handler:
    """A handler set by this module, which a later handler may replace."""

    def __init__(self, act: Callable[[int], None]) -> None:
        self._act = act

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self._act(number)


@contextmanager
def on_ending_signal(act: Callable[[int], None], *, always: bool = True) -> Iterator[None]:
    """Within the context, call ``act`` with the number of each signal that would end the process.

    Signals that are ignored, such as SIGHUP under ``nohup``, or that have another handler are left alone. With
    ``always``, SIGINT and SIGTERM are handled regardless. Python runs handlers only in the main thread, so this
    function does nothing in other threads.
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
        # The garbage collector may close the owner in another thread, which cannot set a handler.
        here = threading.current_thread() is threading.main_thread()
        for number, previous in before.items() if here else ():
            # An interrupt may delay this code, so keep any handler that was set in the meantime.
            if signal.getsignal(number) is handler:
                signal.signal(number, previous)


def ignore_ending_signals() -> None:
    """Leave these signals to the parent process, which ends this process by closing its input."""
    for number in ENDING:
        signal.signal(number, signal.SIG_IGN)
