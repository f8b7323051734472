"""Workers that run calls, in this process or in child processes. A worker that dies loses only its current call."""

import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait
from contextlib import closing, contextmanager
from itertools import chain, islice
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection
from typing import Any, Final, Protocol, TypeVar

from typing_extensions import override

from palpate.core.errors import PalpateError

T = TypeVar("T")
_ONE_THREAD: Final = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMEXPR")}


class Workers(Protocol):
    """Workers that run up to :meth:`count` calls at a time."""

    def count(self) -> int:
        """Return the number of simultaneous calls."""

    def submit(self, function: Callable[..., T], *arguments: Any) -> Future[T]:
        """Start a call; fewer than :meth:`count` may be running."""

    def close(self) -> None:
        """End the workers and their current calls."""


class ThisProcess(Workers):
    """Worker that runs calls sequentially in this process."""

    def count(self) -> int:
        """Return 1, because the calls run sequentially."""
        return 1

    def submit(self, function: Callable[..., T], *arguments: Any) -> Future[T]:
        """Execute a call."""
        future = Future[T]()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future

    def close(self) -> None:
        """Do nothing, because no call is running."""


class LocalWorkers(Workers):
    """Processes on this machine, each in its own pool; a process that dies is replaced."""

    def __init__(self, count: int) -> None:
        # A fork would copy locks held by library threads.
        self._context = get_context("spawn")
        self._leash, self._held = self._context.Pipe(duplex=False)
        self._pools: list[ProcessPoolExecutor | None] = [None] * count
        self._calls: list[Future[Any] | None] = [None] * count

    @override
    def count(self) -> int:
        return len(self._pools)

    @override
    def submit(self, function: Callable[..., T], *arguments: Any) -> Future[T]:
        free = next(n for n, call in enumerate(self._calls) if call is None or call.done())
        pool, last = self._pools[free], self._calls[free]
        if pool is None or (last is not None and isinstance(last.exception(), BrokenExecutor)):
            pool = ProcessPoolExecutor(1, self._context, _begin_worker, (self._leash,))
        with interrupts_wait():
            call = pool.submit(function, *arguments)
        self._pools[free], self._calls[free] = pool, call
        return call

    @override
    def close(self) -> None:
        self._held.close()
        for pool in self._pools:
            if pool is not None:
                pool.shutdown()
        self._leash.close()


def workers_for(jobs: int) -> Workers:
    """Return workers for a number of processes; if the number is 1, calls run in this process."""
    return ThisProcess() if jobs == 1 else LocalWorkers(jobs)


def completed(
    workers: Workers, function: Callable[..., T], calls: Iterable[tuple[Any, ...]]
) -> Iterator[tuple[int, Future[T]]]:
    """Yield the index and future for each call when it is done, in any order.

    A call whose worker died or was interrupted is repeated once; after that the future holds a ``BrokenExecutor`` or a
    ``KeyboardInterrupt``.
    """
    queued, again = enumerate(calls), list[tuple[int, tuple[Any, ...]]]()
    running: dict[Future[T], tuple[int, tuple[Any, ...]]] = {}
    repeated = set[int]()
    while True:
        for number, arguments in islice(chain(_popped(again), queued), max(0, workers.count() - len(running))):
            running[workers.submit(function, *arguments)] = number, arguments
        if not running:
            return
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            number, arguments = running.pop(future)
            if isinstance(future.exception(), (BrokenExecutor, KeyboardInterrupt)) and number not in repeated:
                repeated.add(number)
                again.append((number, arguments))
            else:
                yield number, future


def in_processes(function: Callable[..., T], calls: Iterable[tuple[Any, ...]], jobs: int) -> Generator[T, None, None]:
    """Yield the result of a function for each tuple of arguments, in order.

    Raises:
        PalpateError: Two worker processes died during the same call.
    """
    done, following = dict[int, Future[T]](), 0
    with closing(workers_for(jobs)) as workers:
        for number, future in completed(workers, function, calls):
            done[number] = future
            while following in done:
                try:
                    yield done.pop(following).result()
                except BrokenExecutor as error:
                    causes = "memory is full, or the main program is not a file with 'if __name__ == \"__main__\":'"
                    raise PalpateError(f"two worker processes died during the same work: {causes}") from error
                following += 1


@contextmanager
def interrupts_wait() -> Iterator[None]:
    """Block Ctrl-C while a worker starts; the inherited signal mask protects the worker until it ignores Ctrl-C."""
    # The resource tracker would unblock the signal when it starts with the first worker.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin_worker(leash: Connection) -> None:
    """Prepare a worker: ignore Ctrl-C, and end when the parent ends."""
    # Applies to libraries that are loaded later.
    os.environ.update(_ONE_THREAD)
    os.setpgrp()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(leash,), daemon=True).start()


def _end_with(leash: Connection) -> None:
    # The parent's end of the connection closes when the parent ends for any reason.
    leash.poll(None)
    os.kill(os.getpid(), signal.SIGKILL)


def _popped(calls: list[T]) -> Iterator[T]:
    while calls:
        yield calls.pop()
