"""Workers managed by a Dask scheduler, on this computer or on others that share the study's folder."""

from __future__ import annotations

import ipaddress
import logging
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import ExitStack
from functools import cache
from typing import Any, Final, TypeVar

from typing_extensions import override

import palpate
from palpate.adapters.experiments.executor import Workers
from palpate.adapters.log import made_with, source_sha256
from palpate.core.errors import ConfigurationError, PalpateError, UsageError, describe, one_line

T = TypeVar("T")
LOCAL: Final = "local"
_TIMEOUT_S: Final = 20.0
_START: Final = "start them: dask scheduler --host HOST, dask worker ADDRESS --nthreads 1"


class DaskWorkers(Workers):
    """Workers managed by a Dask scheduler, which repeats a call on another worker if its worker dies.

    Args:
        address: Scheduler address: ``tcp://`` on loopback, or ``tls://`` with certificates in Dask's
            configuration. ``local`` starts a cluster on loopback.
        jobs: Number of processes in a local cluster.

    Raises:
        ConfigurationError: The address is not safe.
        UsageError: Dask is not installed, there is no scheduler or worker, or a worker has different code or several
            threads.
    """

    def __init__(self, address: str, jobs: int) -> None:
        try:
            import dask
            from distributed import Client, LocalCluster
        except ModuleNotFoundError as error:
            raise UsageError(f"--scheduler needs {error.name}: pip install 'palpate[cluster]'") from error
        for name in ("distributed", "distributed.client"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        self.address, self._opened = address, ExitStack()
        # A call is repeated once, as with local workers.
        self._opened.enter_context(dask.config.set({"distributed.scheduler.allowed-failures": 1}))
        try:
            if address == LOCAL:
                cluster = LocalCluster(
                    n_workers=jobs, threads_per_worker=1, processes=True, memory_limit=0, host="127.0.0.1",
                    dashboard_address="127.0.0.1:0", silence_logs=logging.CRITICAL,
                )  # fmt: skip
                self._opened.enter_context(cluster)
                self.address = cluster.scheduler_address
            else:
                _require_safe(address)
            self._client = self._opened.enter_context(Client(self.address, timeout=_TIMEOUT_S))
            self._client.wait_for_workers(1, timeout=_TIMEOUT_S)
            self._require_same_code()
        except (OSError, TypeError, RuntimeError) as error:
            self.close()
            # Dask raises a TypeError if there are no certificates.
            reason = "no certificates in its configuration" if isinstance(error, TypeError) else one_line(error)
            remedy = f"check the certificates, or {_START}" if address.startswith("tls") else _START
            raise UsageError(f"scheduler {address} or its workers cannot be reached ({reason}); {remedy}") from error
        except BaseException:
            self.close()
            raise

    @property
    def dashboard(self) -> str:
        """Dashboard address."""
        return str(self._client.dashboard_link)

    @override
    def count(self) -> int:
        try:
            # If there are no workers, a call waits for one.
            return max(1, len(self._client.nthreads()))
        except OSError as error:
            raise self._ended() from error

    @override
    def submit(self, function: Callable[..., T], *arguments: Any) -> Future[T]:
        call = self._client.get_executor(pure=False).submit(function, *arguments)
        result = Future[T]()
        call.add_done_callback(lambda done: self._hand_over(done, result))
        return result

    @override
    def close(self) -> None:
        self._opened.close()

    def _hand_over(self, done: Future[T], result: Future[T]) -> None:
        from distributed import KilledWorker

        if done.cancelled():
            result.set_exception(self._ended())
        elif isinstance(error := done.exception(), KilledWorker):
            result.set_exception(PalpateError(f"{error.allowed_failures + 1} workers died over it"))
        elif error is not None:
            result.set_exception(error)
        else:
            result.set_result(done.result())

    def _ended(self) -> UsageError:
        return UsageError(f"scheduler {self.address} ended; run the same command again: it continues")

    def _require_same_code(self) -> None:
        own = dict(code_of())
        for worker, code in self._client.run(code_of, on_error="return").items():
            if isinstance(code, Exception):
                raise UsageError(f"worker {worker} cannot run palpate: {describe(code)}")
            if others := [f"{name} {has}, not {own.get(name)}" for name, has in code if has != own.get(name)]:
                raise UsageError(f"worker {worker} has {', '.join(others)}; install the same there")
        for worker, threads in self._client.nthreads().items():
            if threads > 1:
                raise UsageError(f"worker {worker} has {threads} threads, one is allowed; {_START}")


@cache
def code_of() -> tuple[tuple[str, str], ...]:
    """Return a digest of palpate's source, and the versions, all of which must be identical on all workers."""
    return ("source", source_sha256(palpate.__path__)[:12]), *made_with().items()


def _require_safe(address: str) -> None:
    from distributed.comm import parse_address, parse_host_port

    try:
        protocol, place = parse_address(address)
        host, _ = parse_host_port(place)
        local = host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        protocol, local = "", False
    if not (protocol == "tls" or (protocol == "tcp" and local)):
        raise ConfigurationError("scheduler", address, "local, tcp:// on loopback, or tls:// with certificates")
