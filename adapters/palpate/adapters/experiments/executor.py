"""Workers that run calls: this process, or processes that end with it. A death costs the call it was at."""

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
    """Run up to :meth:`count` calls at a time."""

    def count(self) -> int:
        """Return how many calls they take at a time."""

    def submit(self, function: Callable[..., T], *arguments: Any) -> Future[T]:
        """Begin a call; there must be less than :meth:`count` of them."""

    def close(self) -> None:
        """End the workers, and what they are at."""


class ThisProcess(Workers):
    """One call after the other in this process."""

    def count(self) -> int:
        """Return 1."""
        return 1

    def submit(self, function: Callable[..., T], *arguments: Any) -> Future[T]:
        """Make a call."""
        future = Future[T]()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future

    def close(self) -> None:
        """Nothing of it outlives a call."""


class LocalWorkers(Workers):
    """Processes of this machine, each a pool of its own; another one takes the place of one that died."""

    def __init__(self, count: int) -> None:
        # A fork would copy the locked locks of libraries' threads.
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
    """Return a number of processes; this one for 1."""
    return ThisProcess() if jobs == 1 else LocalWorkers(jobs)


def completed(
    workers: Workers, function: Callable[..., T], calls: Iterable[tuple[Any, ...]]
) -> Iterator[tuple[int, Future[T]]]:
    """Yield the number of each call and its future as soon as it is done, in any order.

    A call whose worker died or was interrupted runs once more; then the future holds a ``BrokenExecutor`` or a
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
    """Yield what a function returns for each tuple of arguments, in their order.

    Raises:
        PalpateError: Two worker processes died over the same call.
    """
    done, following = dict[int, Future[T]](), 0
    with closing(workers_for(jobs)) as workers:
        for number, future in completed(workers, function, calls):
            done[number] = future
            while following in done:
                try:
                    yield done.pop(following).result()
                except BrokenExecutor as error:
                    raise PalpateError("two worker processes died over the same work; is the memory full?") from error
                following += 1


@contextmanager
def interrupts_wait() -> Iterator[None]:
    """Hold back Ctrl-C while a worker starts: until it ignores the signal itself, it keeps this thread's mask."""
    # The tracker would let the signal through when it starts with the first worker.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin_worker(leash: Connection) -> None:
    """In a worker: leave Ctrl-C to the parent, and end with it."""
    # For libraries that are loaded later.
    os.environ.update(_ONE_THREAD)
    os.setpgrp()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(leash,), daemon=True).start()


def _end_with(leash: Connection) -> None:
    # The parent's end closes with the parent, however that ends.
    leash.poll(None)
    os.kill(os.getpid(), signal.SIGKILL)


def _popped(calls: list[T]) -> Iterator[T]:
    while calls:
        yield calls.pop()
