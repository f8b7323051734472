"""Processes that work for the one that began them: they end with it, and Ctrl-C is its affair alone."""

import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import Any, Final, TypeVar

T = TypeVar("T")
_WATCH_S: Final = 0.1
ONE_THREAD: Final = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMEXPR")}


def in_processes(function: Callable[..., T], calls: Iterable[tuple[Any, ...]], jobs: int) -> Generator[T, None, None]:
    """What a function gives for each tuple of arguments, in their order."""
    from joblib import Parallel, delayed

    parallel = Parallel(n_jobs=jobs, return_as="generator", initializer=begin_worker, initargs=(os.getpid(),))
    with interrupts_wait():
        given = parallel(delayed(function)(*arguments) for arguments in calls)
    try:
        for result in given:  # noqa: UP028  (with "yield from" it would be closed before warnings are ignored)
            yield result
    finally:
        with warnings.catch_warnings():
            # joblib warns of the calls that it cancels when it is closed early.
            warnings.simplefilter("ignore", UserWarning)
            given.close()


def begin_worker(parent: int) -> None:
    """In a worker: Ctrl-C is the affair of the parent, which then ends its workers; and they do not outlive it."""
    # For libraries that are loaded later.
    os.environ.update(ONE_THREAD)
    os.setpgrp()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


@contextmanager
def interrupts_wait() -> Iterator[None]:
    """Hold back Ctrl-C while workers are begun: until they ignore it themselves, they keep this thread's mask."""
    # It would let them through again when it is begun with the first worker.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with(parent: int) -> None:
    # A worker whose parent was killed would wait for work for ever.
    while os.getppid() == parent:
        time.sleep(_WATCH_S)
    os.kill(os.getpid(), signal.SIGKILL)
