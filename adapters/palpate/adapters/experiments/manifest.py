"""The manifest of a run folder: what belongs to the run, byte for byte, so that what is missing or altered is found.

``manifest.json`` is replaced whole after every trial and once more at the end. Until the end it is open: it then tells
of run.toml, of the tables as far as they had grown, and of the logs that were closed; what came after the last trial
that it lists is no fault, for a run may be killed at any moment.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from palpate.adapters.log import LOG_FOLDER
from palpate.core.errors import OutputError
from palpate.core.ports import json_of_file, write_whole

MANIFEST: Final = "manifest.json"
SCHEMA: Final = "palpate.manifest/1"
GROWING: Final = ("trials.csv", "decisions.csv")
"""Tables that get lines trial by trial."""


@dataclass(frozen=True)
class Print:
    """What a file is told by: its size and its digest."""

    size: int
    sha256: str

    @classmethod
    def of(cls, path: Path, first: int | None = None) -> Print:
        """That of a file, or of its first bytes."""
        data = path.read_bytes()
        data = data if first is None else data[:first]
        return cls(len(data), hashlib.sha256(data).hexdigest())


class Manifest:
    """Writes the manifest of a run that is under way."""

    def __init__(self, folder: Path, command: str) -> None:
        self._folder, self._command = folder, command
        self._trials = 0
        self._files: dict[str, Print] = {}
        self._grown = {name: _Grown(folder / name) for name in GROWING}

    def begin(self, trials: int) -> None:
        """Open it, for a run that has so many trials already: what is there of them is taken as it is."""
        known = read_manifest(self._folder)
        if known is not None:
            known.problems(self._folder)
        self._trials = trials
        self._files["run.toml"] = Print.of(self._folder / "run.toml")
        for name in _logs(self._folder):
            kept = None if known is None else known.files.get(name)
            self._files[name] = kept or Print.of(self._folder / name)
        self._write(finished=False)

    def trial(self, closed: Mapping[str, tuple[int, str]]) -> None:
        """One trial more is finished; size and digest of logs closed meanwhile, by their absolute paths."""
        self._trials += 1
        self._take(closed)
        self._write(finished=False)

    def end(self, closed: Mapping[str, tuple[int, str]]) -> None:
        """Nothing comes any more: all files of the folder that a run leaves are this run's."""
        self._take(closed)
        here = [name for name in RUN_FILES if (self._folder / name).is_file()]
        told = {name: Print.of(self._folder / name) for name in here}
        told |= {name: self._files.get(name) or Print.of(self._folder / name) for name in _logs(self._folder)}
        # A log that was closed and is not there any more stays in the list.
        self._files = self._files | told
        self._write(finished=True)

    def _take(self, closed: Mapping[str, tuple[int, str]]) -> None:
        top = os.path.abspath(self._folder)
        self._files.update({os.path.relpath(path, top): Print(*told) for path, told in closed.items()})

    def _write(self, *, finished: bool) -> None:
        grown = {} if finished else {name: one.now() for name, one in self._grown.items() if one.exists}
        write_manifest(self._folder, self._command, self._trials, self._files | grown, finished=finished)


def write_manifest(folder: Path, command: str, trials: int, files: Mapping[str, Print], *, finished: bool) -> None:
    """Write or replace the manifest of a folder."""
    content = {
        "schema": SCHEMA,
        "command": command,
        "finished": finished,
        "trials": trials,
        "files": {name: {"bytes": one.size, "sha256": one.sha256} for name, one in sorted(files.items())},
    }
    # After every trial: waiting for the disk would take a twentieth of a simulated one.
    text = json.dumps(content, indent=1) + "\n"
    write_whole(folder / MANIFEST, text, remedy="the run's results are there", durable=finished)


class _Grown:
    """A table that only grows: each byte of it is read once."""

    def __init__(self, path: Path) -> None:
        self._path, self._digest, self._size = path, hashlib.sha256(), 0

    @property
    def exists(self) -> bool:
        return self._path.exists()

    def now(self) -> Print:
        with self._path.open("rb") as stream:
            stream.seek(self._size)
            data = stream.read()
        self._digest.update(data)
        self._size += len(data)
        return Print(self._size, self._digest.hexdigest())


@dataclass(frozen=True)
class KnownFolder:
    """What a manifest says of its folder.

    Attributes:
        finished: Whether the run came to an end; else it is under way, or was cut short.
    """

    path: Path
    finished: bool
    trials: int
    files: Mapping[str, Print]

    def problems(self, folder: Path) -> list[str]:
        """What is missing, cut, altered or foreign, a line each."""
        found = [(name, _fault(folder / name, one, self._grows(name))) for name, one in self.files.items()]
        if found and all(fault for _, fault in found):
            remedy = "put the right one in its place, or take it away: the logs replay without"
            raise OutputError(str(self.path), "is that of another run, for nothing here is as it says", remedy)
        told = [f"{folder / name}: {fault}" for name, fault in found if fault]
        told += [f"{folder / name}: is none of this run" for name in self._foreign(folder)]
        return told

    def _grows(self, name: str) -> bool:
        return not self.finished and name in GROWING

    def _foreign(self, folder: Path) -> Iterator[str]:
        logs = [name for name in _logs(folder) if name not in self.files]
        yield from (name for name in logs if not self._may_follow(name))
        if self.finished:
            yield from (name for name in RUN_FILES if name not in self.files and (folder / name).is_file())

    def _may_follow(self, name: str) -> bool:
        """Whether a log that is not listed may be of the trial that was under way, or closed after the last entry."""
        number = name.rpartition("/")[2].removeprefix("trial-").partition(".")[0]
        return not self.finished and number.isdigit() and int(number) <= self.trials + 1


RUN_FILES: Final = (
    "run.toml", "trials.csv", "decisions.csv", "checkpoint.json", "policy.json", "summary.json", "learning_curve.png",
    "trials.png", "compare.csv", "compare.txt", "cell.json", "examples.csv",
)  # fmt: skip
"""Files that a run leaves, besides its logs."""


def _fault(path: Path, told: Print, grows: bool) -> str:
    try:
        now = Print.of(path, told.size if grows else None)
    except OSError:
        return "is missing"
    if now == told:
        return ""
    return f"is cut or altered: it has {now.size} of {told.size} bytes" if now.size < told.size else "is altered"


def _logs(folder: Path) -> list[str]:
    top = folder / LOG_FOLDER
    return [str(path.relative_to(folder)) for path in sorted(top.rglob("*")) if path.is_file()]


def read_manifest(folder: Path) -> KnownFolder | None:
    """The manifest of a folder; None where there is none.

    Raises:
        OutputError: It cannot be read.
    """
    path = folder / MANIFEST
    if not os.path.lexists(path):
        return None
    try:
        content = json_of_file(path)
        if content["schema"] != SCHEMA:
            raise OutputError(str(path), f"has schema {content['schema']!r}", f"this palpate reads {SCHEMA!r}")
        files = {str(name): Print(int(one["bytes"]), str(one["sha256"])) for name, one in content["files"].items()}
        return KnownFolder(path, bool(content["finished"]), int(content["trials"]), files)
    except (OSError, ValueError, OverflowError, KeyError, TypeError, AttributeError) as error:
        problem = f"is no manifest ({type(error).__name__}: {error})"
        raise OutputError(str(path), problem, "it was altered; take it away: the logs replay without") from error
