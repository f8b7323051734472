"""The manifest of a run folder is right at every moment, wherever the run is killed."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import palpate.core.ports.files as files
from palpate.adapters.experiments import read_manifest
from palpate.adapters.experiments.manifest import MANIFEST, Manifest, Print
from palpate.core.errors import OutputError

TRIALS = 3


class _KilledError(BaseException):
    """Nothing after this is done, as after ``kill -9``."""


def _run(folder: Path, step: Callable[[], None]) -> None:
    """A run as commands make one; ``step`` comes before everything that reaches the disk."""

    def write(name: str, text: str, *, more: bool = False) -> None:
        step()
        with (folder / name).open("a" if more else "w") as stream:
            stream.write(text)

    (folder / "logs").mkdir()
    write("run.toml", "seed = 0\n")
    manifest = Manifest(folder, "train")
    manifest.begin(0)
    for trial in range(TRIALS):
        log = f"logs/trial-{trial:05d}.mcap"
        write(log, "half")
        write(log, " a log", more=True)
        for table in ("trials.csv", "decisions.csv"):
            # A line that is longer than a page may be there in part.
            write(table, f"{trial},", more=True)
            write(table, "x\n", more=True)
        write("checkpoint.json", f"{trial}")
        # The writer is behind by a log.
        known = [] if trial == 0 else [folder / f"logs/trial-{trial - 1:05d}.mcap"]
        told = {str(path.absolute()): Print.of(path) for path in known}
        manifest.trial({path: (one.size, one.sha256) for path, one in told.items()})
    write("policy.json", "{}")
    write("summary.json", "{}")
    manifest.end({})


def test_wherever_it_is_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    replace = files.os.replace
    moments = 0
    for last in range(1000):
        folder = tmp_path / str(last)
        folder.mkdir()
        left = last

        def step() -> None:
            nonlocal left
            if left == 0:
                raise _KilledError
            left -= 1

        def put(*names: Any, step: Callable[[], None] = step) -> None:
            step()
            replace(*names)

        monkeypatch.setattr(files.os, "replace", put)
        ended = True
        try:
            _run(folder, step)
        except _KilledError:
            ended = False
        known = read_manifest(folder)
        if known is not None:
            assert known.problems(folder) == [], last
            assert known.finished == ended
            moments += 1
        if ended:
            break
    assert moments > 20


def test_a_run_that_goes_on_keeps_what_is_known_of_its_logs(tmp_path: Path) -> None:
    _run(tmp_path, lambda: None)
    (tmp_path / "logs" / "trial-00001.mcap").write_text("another")
    manifest = Manifest(tmp_path, "train")
    manifest.begin(TRIALS)
    known = read_manifest(tmp_path)
    assert known is not None
    assert not known.finished
    assert known.problems(tmp_path) == [f"{tmp_path}/logs/trial-00001.mcap: is cut or altered: it has 7 of 10 bytes"]


def test_a_manifest_with_a_size_that_is_no_number_is_refused(tmp_path: Path) -> None:
    _run(tmp_path, lambda: None)
    path = tmp_path / MANIFEST
    path.write_text(re.sub(r'"bytes": \d+', '"bytes": 1e999', path.read_text()))
    with pytest.raises(OutputError, match="is no manifest"):
        read_manifest(tmp_path)
