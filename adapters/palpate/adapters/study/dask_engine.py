"""Cells on the workers of a Dask cluster: one that is there, or one of this machine's own."""

from __future__ import annotations

import logging
import os
import uuid
from collections.abc import Generator, Iterable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any, Final, Self

from joblib import Parallel, delayed, parallel_config

from palpate.adapters.provenance import made_with
from palpate.adapters.study.engines import MOST_DEATHS, ONE_THREAD, Engine
from palpate.adapters.study.run_cell import CellJob, CellOutcome, CellReport, begun, make_cell
from palpate.core.errors import ConfigurationError, DeviceError, OutputError

_PATIENCE_S: Final = 10.0


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
        # What goes wrong is told in one line, by us.
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
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
        """Make sure that every worker sees the study's folder.

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

    def run(self, jobs: Iterable[CellJob]) -> Generator[CellReport, None, None]:
        """See :class:`Engine`."""
        from distributed import KilledWorker

        left = {job.cell.name: job for job in jobs}
        while left:
            try:
                with parallel_config(backend="dask", client=self._client):
                    reports = Parallel(n_jobs=-1, return_as="generator_unordered", batch_size=1)(
                        delayed(make_cell)(job) for job in list(left.values())
                    )
                with closing(reports):
                    for report in reports:
                        if report.begun_before:
                            yield CellReport(report.name, CellOutcome.DIED)
                        if report.outcome is not CellOutcome.INTERRUPTED:
                            del left[report.name]
                            yield report
            except KilledWorker:
                # Dask gave up a task, and joblib with it all others. Which cell it was, the attempts at it tell.
                yield from self._given_up(left)

    def _given_up(self, left: dict[str, CellJob]) -> Iterator[CellReport]:
        over = [name for name, job in left.items() if len(begun(Path(job.folder), name)) >= MOST_DEATHS]
        if not over:
            raise DeviceError("dask", "workers die before they begin; look at their logs")
        for name in over:
            del left[name]
            yield CellReport(name, CellOutcome.FAILED, f"its worker died {MOST_DEATHS} times")

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


_ACCEPTED: Final = "the address of a Dask scheduler that answers, such as tcp://127.0.0.1:8786"
