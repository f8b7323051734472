"""Cells on the workers of a Dask cluster: one that is there, or one of this machine's own."""

from __future__ import annotations

import logging
import os
import socket
import uuid
from collections.abc import Generator, Iterable, Iterator
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from typing import Any, Final, Self
from urllib.parse import urlsplit

from typing_extensions import override

from palpate.adapters.experiments.study.engines import ONE_THREAD, Engine
from palpate.adapters.experiments.study.run_cell import CellJob, CellOutcome, CellReport, make_cell
from palpate.adapters.log import made_with
from palpate.core.errors import ConfigurationError, DeviceError, OutputError

_PATIENCE_S: Final = 10.0
_LOGGERS: Final = ("client", "core", "scheduler", "nanny", "worker", "comm", "batched")
_PORT: Final = 8786
"""Of schedulers, where an address has none."""


class Dask(Engine):
    """The workers of a Dask cluster. A context manager: on exit the connection, and a cluster of its own, are closed.

    Args:
        address: Of a scheduler; empty starts workers on this machine.
        count: Number of those.
    """

    def __init__(self, address: str, count: int) -> None:
        self._address, self._count = address, count

    def __enter__(self) -> Self:
        try:
            from distributed import Client, LocalCluster
        except ImportError as error:
            accepted = "sequential or processes, unless Dask is installed: pip install 'palpate[dask]'"
            raise ConfigurationError("engine", "dask", accepted) from error
        # What goes wrong is reported in one line, here.
        for name in _LOGGERS:
            logging.getLogger(f"distributed.{name}").setLevel(logging.CRITICAL)
        if self._address:
            _require_answer(self._address)
        with ExitStack() as opened:
            if not self._address:
                cluster = LocalCluster(
                    n_workers=self._count,
                    threads_per_worker=1,
                    host="127.0.0.1",
                    dashboard_address=None,
                    env=ONE_THREAD,
                )
                opened.callback(cluster.close)
            try:
                self._client: Any = Client(self._address or cluster, timeout=_PATIENCE_S, set_as_default=False)
            except (OSError, ValueError, ImportError, TypeError) as error:
                raise ConfigurationError("scheduler", self._address, _ACCEPTED) from error
            opened.callback(self._client.close)
            if not self._address:
                self._client.wait_for_workers(self._count)
            self._require_same_versions()
            self._opened = opened.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.close()

    def require_sight(self, folder: Path) -> None:
        """Make sure that every worker has access to the study's folder.

        Raises:
            OutputError: One does not.
        """
        token = folder / f".{uuid.uuid4().hex}"
        try:
            token.touch()
            seen = self._client.run(os.path.exists, str(token))
        finally:
            token.unlink(missing_ok=True)
        if blind := sorted(worker for worker, sees in seen.items() if not sees):
            raise OutputError(
                str(folder),
                f"is not seen by the worker {blind[0]}",
                "name a folder that all machines share, with --out",
            )

    @override
    def run(self, jobs: Iterable[CellJob]) -> Generator[CellReport, None, None]:
        """Make the cells on the cluster.

        Through Dask's own futures: joblib would leave a cluster of one worker alone and do the work in this process,
        and would give up all cells with the one over which workers die.

        Raises:
            DeviceError: The scheduler is gone.
        """
        from distributed import as_completed

        fresh, running = iter(jobs), dict[Any, CellJob]()
        done = as_completed(loop=self._client.loop)
        try:
            while True:
                # Workers may come and go; some more cells than there are threads keep them busy.
                for job in islice(fresh, max(0, 1 + 2 * sum(self._client.ncores().values()) - len(running))):
                    future = self._client.submit(make_cell, job, pure=False)
                    running[future] = job
                    done.add(future)
                if not running:
                    return
                future = next(done)
                yield from self._reports(future, running.pop(future))
        finally:
            if self._client.status == "running":
                self._client.cancel(list(running))

    def _reports(self, future: Any, job: CellJob) -> Iterator[CellReport]:
        from distributed import KilledWorker

        if future.cancelled():
            raise DeviceError("dask", "the scheduler is gone; finished cells are kept, the same command goes on")
        try:
            report: CellReport = future.result()
        except KilledWorker:
            yield CellReport(job.cell.name, CellOutcome.FAILED, "its workers died")
            return
        for _ in range(report.begun_before):
            yield CellReport(report.name, CellOutcome.DIED)
        yield report

    def _require_same_versions(self) -> None:
        theirs = self._client.run(made_with)
        if not theirs:
            raise ConfigurationError("scheduler", self._address, "a scheduler that has workers")
        own = made_with()
        for worker, versions in sorted(theirs.items()):
            for name, version in own.items():
                if versions.get(name) != version:
                    accepted = f"{version} on every worker, as here; {worker} has another"
                    raise ConfigurationError(f"versions.{name}", versions.get(name), accepted)


def _require_answer(address: str) -> None:
    """Make sure that a server listens there: Dask's own client gives up slowly and logs much."""
    try:
        found = urlsplit(address if "://" in address else f"tcp://{address}")
        socket.create_connection((found.hostname, found.port or _PORT), _PATIENCE_S).close()
    except (OSError, ValueError) as error:
        raise ConfigurationError("scheduler", address, _ACCEPTED) from error


_ACCEPTED: Final = "the address of a Dask scheduler that answers, such as tcp://127.0.0.1:8786"
