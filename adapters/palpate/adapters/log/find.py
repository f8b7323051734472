"""Search for logs by file name, folder or glob pattern."""

import glob
import os
from collections.abc import Sequence
from pathlib import Path

from palpate.core.errors import LogError


def find_logs(names: Sequence[str | Path]) -> list[Path]:
    """Return the logs that match file names, folders (searched recursively) and glob patterns, without duplicates.

    Raises:
        LogError: A name matches no log.
    """
    found: dict[Path, None] = {}
    for name in map(str, names):
        if os.path.isdir(name):
            below = sorted(Path(name).rglob("*.mcap"))
            if not below:
                raise LogError(name, "", "holds no logs", "name a folder with .mcap files in it or below it")
            found.update(dict.fromkeys(below))
        elif os.path.lexists(name):
            found[Path(name)] = None
        else:
            matches = sorted(glob.glob(name, recursive=True))
            if not matches:
                raise LogError(name, "", "is not there", "name a log, a folder of logs, or a pattern in quotes")
            found.update(dict.fromkeys(find_logs(matches)))
    return list(found)
