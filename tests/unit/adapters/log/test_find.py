"""Finding logs, and calls that are refused."""

from pathlib import Path

import pytest

from palpate.adapters.log import find_logs
from palpate.adapters.replay import WhatIf, replay_files
from palpate.core.errors import ConfigurationError, LogError


def test_files_folders_and_patterns_once_each(tmp_path: Path) -> None:
    for name in ("b.mcap", "a.mcap", "deep/c.mcap", "notes.txt", "d.mcap.cut-short-1"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"")
    names = [str(tmp_path / "b.mcap"), str(tmp_path), str(tmp_path / "*.mcap")]
    assert [path.name for path in find_logs(names)] == ["b.mcap", "a.mcap", "c.mcap"]
    # What is named outright is taken, whatever it is called.
    assert len(find_logs([str(tmp_path / "notes.txt")])) == 1


def test_calls_that_are_none_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="jobs = 0 is refused: a whole number from 1 to 1024"):
        next(replay_files([], WhatIf(), 0))
    with pytest.raises(LogError, match="nowhere: is not there"):
        find_logs([tmp_path / "nowhere"])
