"""The logs of a folder: which there are, which are whole, and which of them a report reads."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from mcap.writer import MCAP0_MAGIC

from palpate.adapters.log.reader import TrialLog, read_log
from palpate.adapters.log.trial_recorder import LOG_FOLDER
from palpate.core.errors import LogError

_TORN: Final = "ends in the middle, so it is torn or still being written"
_REMEDY: Final = "palpate log recover writes a sound one (then move this one away), or leave logs out with --no-logs"


def logs_in(folder: Path) -> tuple[Path, ...]:
    """The logs below a run's folder ``logs``, each looked at from both ends.

    Raises:
        LogError: One is torn, or cannot be read.
    """
    found = tuple(sorted((folder / LOG_FOLDER).rglob("*.mcap")))
    for path in found:
        _require_whole(path)
    return found


def spread_over(paths: Sequence[Path], most: int) -> tuple[Path, ...]:
    """At most so many of them, evenly: the first and the last are there."""
    if len(paths) <= most:
        return tuple(paths)
    return tuple(paths[round(k * (len(paths) - 1) / (most - 1))] for k in range(most))


class LogShelf:
    """Reads logs, each once."""

    def __init__(self) -> None:
        self._logs: dict[Path, TrialLog] = {}

    def log(self, path: Path) -> TrialLog:
        """A log.

        Raises:
            LogError: It is damaged.
        """
        if path not in self._logs:
            self._logs[path] = read_log(path)
        return self._logs[path]


def _require_whole(path: Path) -> None:
    size = len(MCAP0_MAGIC)
    try:
        with path.open("rb") as stream:
            whole = stream.read(size) == MCAP0_MAGIC
            stream.seek(0, os.SEEK_END)
            whole = whole and stream.tell() > 2 * size
            if whole:
                stream.seek(-size, os.SEEK_END)
                whole = stream.read(size) == MCAP0_MAGIC
    except OSError as error:
        raise LogError(
            str(path), "", f"cannot be read ({error.strerror})", "or leave logs out with --no-logs"
        ) from error
    if not whole:
        raise LogError(str(path), "", _TORN, _REMEDY)
