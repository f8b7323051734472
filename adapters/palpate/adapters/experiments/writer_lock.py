"""One writer a folder: a lock of the system's, which ends with whoever holds it, however that ends."""

import fcntl
import os
import shlex
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from palpate.core.errors import OutputError

LOCK: Final = ".lock"
"""File that is locked. It says who writes here; after a good end it is gone."""


@contextmanager
def only_writer(folder: Path) -> Iterator[str]:
    """Keep every other writer out of a folder; gives who wrote here before without a good end, empty for nobody."""
    path = folder / LOCK
    descriptor = _locked(path)
    try:
        before = _written(descriptor)
        os.ftruncate(descriptor, 0)
        since = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
        who = f"process {os.getpid()} on {socket.gethostname()} since {since}: {shlex.join(sys.argv)}\n"
        os.pwrite(descriptor, who.encode(), 0)
        try:
            yield before
        finally:
            # While it is locked: who waits for it then finds another file of this name, or none.
            os.unlink(path)
    finally:
        os.close(descriptor)


def _locked(path: Path) -> int:
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            who = _written(descriptor) or "another process"
            os.close(descriptor)
            remedy = "wait for its end, or name another folder with --out"
            raise OutputError(str(path.parent), f"is being written by {who}", remedy) from error
        if os.path.lexists(path) and os.path.samestat(os.stat(path), os.fstat(descriptor)):
            return descriptor
        os.close(descriptor)


def _written(descriptor: int) -> str:
    return os.pread(descriptor, 4096, 0).decode("utf-8", "replace").strip()
