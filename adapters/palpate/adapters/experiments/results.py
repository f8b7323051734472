"""A run's folder. Files are replaced atomically, so that nothing is lost if an error occurs.

It contains ``run.toml`` (resolved configuration and versions), ``trials.csv``, ``decisions.csv``, ``policy.json``,
``summary.json`` and ``learning_curve.png``. ``--resume`` continues from ``checkpoint.json``. ``logs`` contains
a recording of each trial.
"""

from __future__ import annotations

import csv
import dataclasses
import fcntl
import json
import os
import shlex
import socket
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import Any, Final

from palpate.adapters.config import RecordingConfig
from palpate.adapters.experiments.trial import ScoredTrial
from palpate.adapters.files import json_of_file, whole_text, write_whole
from palpate.adapters.log import LOG_FOLDER, TrialRecorder, csv_text
from palpate.core.errors import LifecycleError, OutputError

LOCK: Final = ".lock"
"""Lock file that names the writer; it is removed after a normal exit."""


@contextmanager
def only_writer(folder: Path) -> Iterator[str]:
    """Lock a folder against other writers; yield the previous writer if it crashed, or an empty string."""
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
            # Removed while locked, so that a waiting writer finds a new file with this name, or none.
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


RUN_FILES: Final = (
    "run.toml", "trials.csv", "decisions.csv", "checkpoint.json", "policy.json", "summary.json", "learning_curve.png",
    "trials.png", "compare.csv", "compare.txt", "examples.csv",
)  # fmt: skip
"""Files in a run folder other than the logs."""
_OF_DECISION: Final = ("tick", "symbol", "state", "action", "source", "reinforcement")


@dataclasses.dataclass(frozen=True)
class TrialRow:
    """A line in ``trials.csv``. If the hole is unknown, its columns are empty.

    Attributes:
        trip: Name and text of the reason for a trip; empty without a trip.
        drawn: Other values for the trial, each in its own column after the others; see also ``GroundTruth.drawn``.
    """

    trial: int
    outcome: str
    success: bool
    exploration_time_s: float
    actions: int
    peak_force_N: float
    measured_peak_force_N: float
    depth_mm: float
    start_x_mm: float
    start_y_mm: float
    hole_x_mm: float | None
    hole_y_mm: float | None
    ticks: int
    temperature: float | None
    flagged: str
    trip: str
    drawn: Mapping[str, float] = dataclasses.field(default_factory=dict)

    @classmethod
    def of(cls, scored: ScoredTrial, first: int = 0) -> TrialRow:
        """Return the line for a trial, with the true force and depth if known, and the force measured by the core."""
        report, truth = scored.report, scored.truth
        known = report if truth is None else truth
        return cls(
            trial=report.setup.index - first,
            outcome=scored.outcome,
            success=scored.success,
            exploration_time_s=round(scored.exploration_time_s, 6),
            actions=report.actions,
            peak_force_N=round(known.peak_force_N, 6),
            measured_peak_force_N=round(report.peak_force_N, 6),
            depth_mm=round(known.depth_m * 1e3, 6),
            start_x_mm=round(report.setup.start_m[0] * 1e3, 6),
            start_y_mm=round(report.setup.start_m[1] * 1e3, 6),
            hole_x_mm=None if truth is None else round(truth.hole_in_task_m[0] * 1e3, 6) + 0.0,
            hole_y_mm=None if truth is None else round(truth.hole_in_task_m[1] * 1e3, 6) + 0.0,
            ticks=report.ticks,
            temperature=report.temperature,
            flagged=scored.flagged,
            trip=scored.trip,
            drawn=scored.own if truth is None else {**scored.own, **truth.drawn},
        )

    def cells(self) -> dict[str, Any]:
        """Return the contents of each column."""
        own = {f.name: getattr(self, f.name) for f in _COLUMNS}
        return own | dict(self.drawn)

    @classmethod
    def read(cls, cells: dict[str, str]) -> TrialRow:
        """Restore a line from its cells."""
        others = dict(cells)
        values = {f.name: _READ.get(str(f.type), _number)(others.pop(f.name)) for f in _COLUMNS}
        return cls(**values, drawn={name: float(text) for name, text in others.items()})


def _number(text: str) -> float | None:
    return float(text) if text else None


_COLUMNS: Final = dataclasses.fields(TrialRow)[:-1]
_READ: Final[Mapping[str, Callable[[str], Any]]] = {"str": str, "int": int, "bool": lambda text: text == "True"}
"""Functions that parse a cell, by the type of its column; cells of other columns are numbers or empty."""


@dataclasses.dataclass(frozen=True)
class RunResult:
    """Results from finished trials.

    Attributes:
        rows: Lines in ``trials.csv``.
        summary: Statistics for all trials, as in ``summary.json``.
        finished: True if all requested trials are finished.
        folder: The run's folder, or None if nothing was saved.
        losses: Recording failures.
        timing: Timing report from the control loop; empty in the simulator.
    """

    rows: list[TrialRow]
    summary: dict[str, Any]
    finished: bool
    folder: RunFolder | None = None
    losses: Sequence[str] = ()
    timing: str = ""

    @property
    def policy(self) -> Path:
        """The policy file."""
        return self._path("policy.json")

    @property
    def logs(self) -> list[Path]:
        """Trial logs, in order."""
        return sorted(self._path(LOG_FOLDER).glob("*.mcap"))

    def _path(self, name: str) -> Path:
        if self.folder is None:
            raise LifecycleError("run", "without a folder", name, "name a folder: out=...")
        return self.folder.path / name


def folder_named(out: str | os.PathLike[str], stem: str) -> RunFolder:
    """Return the folder ``out``; if empty, the first ``runs/stem-001``, ``runs/stem-002``, ... that does not exist."""
    names = (f"runs/{stem}-{number:03d}" for number in count(1))
    return RunFolder(Path(out or next(name for name in names if not os.path.lexists(name))))


def _holds(path: Path) -> bool:
    """Return True if a folder is not empty; a run killed before writing a file leaves an empty log folder."""
    return bool(os.listdir(path)) if os.path.isdir(path) else os.path.exists(path)


class RunFolder:
    """The output folder for one run."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def require_free(self) -> None:
        """Check that nothing would be overwritten.

        Raises:
            OutputError: The folder already holds a run.
        """
        # os.path.exists, unlike Path.exists, returns False for a name that is too long or not permitted.
        if os.path.exists(self.path) and not os.path.isdir(self.path):
            raise OutputError(str(self.path), "is a file, not a folder", "name another folder with --out")
        found = [name for name in (*RUN_FILES, LOG_FOLDER) if _holds(self.path / name)]
        if found:
            remedy = "name another folder with --out"
            if os.path.exists(self.path / "checkpoint.json"):
                remedy += f", or resume that training: palpate train --resume --out {shlex.quote(str(self.path))}"
            raise OutputError(str(self.path), f"already holds a run ({found[0]})", remedy)

    def create(self) -> None:
        """Create the folder for a new run.

        Raises:
            OutputError: The folder holds a run.
        """
        self.require_free()
        self.path.mkdir(parents=True, exist_ok=True)

    @contextmanager
    def writing(self, *, again: bool = False) -> Iterator[None]:
        """Create the folder and lock it for the context; print a message if an earlier writer crashed.

        Raises:
            OutputError: Another process is writing to it.
        """
        if not again:
            self.create()
        with only_writer(self.path) as before:
            if not again:
                # Another process may have created a run since the check.
                self.require_free()
            if before:
                sys.stderr.write(f"palpate: {self.path} was left unfinished by {before}; it continues from there\n")
            yield

    def recorder(self, config: RecordingConfig, opened: ExitStack) -> TrialRecorder | None:
        """Return a recorder that writes to the ``logs`` folder until ``opened`` closes, or None without recording."""
        recorder = TrialRecorder.into(self.path / LOG_FOLDER, config)
        return None if recorder is None else opened.enter_context(recorder)

    def summary(self) -> dict[str, Any]:
        """Return ``summary.json``, which a run writes last, or an empty table if there is none.

        Raises:
            OutputError: The file is damaged.
        """
        path = self.path / "summary.json"
        try:
            return dict(json_of_file(path)) if path.exists() else {}
        except (ValueError, TypeError, OSError) as error:
            raise OutputError(str(path), f"cannot be read ({error})", "fix it or begin a new run") from error

    def write(self, name: str, content: str | bytes, *, durable: bool = True) -> None:
        """Write or replace a file atomically; for ``durable``, see :func:`write_whole`."""
        write_whole(self.path / name, content, durable=durable)

    def write_json(self, name: str, content: Any, *, durable: bool = True) -> None:
        """Write or replace a JSON file, as :meth:`write` does."""
        self.write(name, json.dumps(content, indent=1) + "\n", durable=durable)

    def append_trial(self, scored: ScoredTrial, first: int = 0) -> TrialRow:
        """Add a finished trial to ``trials.csv`` and ``decisions.csv``; for ``first``, see ``TrialRow.of``."""
        row, report = TrialRow.of(scored, first), scored.report
        cells = row.cells()
        self._append("trials.csv", tuple(cells), [tuple(cells.values())])
        decisions = [
            (row.trial, *(getattr(decision, name) for name in _OF_DECISION), report.temperature)
            for decision in report.decisions
        ]
        self._append("decisions.csv", ("trial", *_OF_DECISION, "temperature"), decisions)
        return row

    def read_trials(self) -> list[TrialRow]:
        """Return the finished trials.

        Raises:
            OutputError: The file is damaged.
        """
        path = self.path / "trials.csv"
        if not path.exists():
            return []
        try:
            with whole_text(path, newline="") as stream:
                lines = stream.readlines()
            if lines and not lines[-1].endswith("\n"):
                # The damaged line may still parse as numbers.
                raise ValueError("its last line is not whole")
            return [TrialRow.read(cells) for cells in csv.DictReader(lines)]
        except (KeyError, ValueError, TypeError, OSError) as error:
            raise OutputError(str(path), f"cannot be read ({error})", "fix it or begin a new run") from error

    def truncate(self, trials: int) -> None:
        """Keep only the first trials; those after the last checkpoint will be repeated, with identical results."""
        for name in ("trials.csv", "decisions.csv"):
            path = self.path / name
            if path.exists():
                lines = whole_text(path).read().splitlines(keepends=True)
                whole = [line for line in lines if line.endswith("\n")]
                try:
                    kept = [line for line in whole[1:] if int(line.split(",", 1)[0]) < trials]
                except ValueError as error:
                    raise OutputError(str(path), f"is damaged ({error})", "fix it or begin a new run") from error
                self.write(name, "".join(whole[:1] + kept))

    def _append(self, name: str, columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
        path = self.path / name
        # A run that was killed may have left the file without its header.
        head = [] if path.exists() and path.stat().st_size else [columns]
        with path.open("a", encoding="utf-8", newline="") as stream:
            stream.write(csv_text([*head, *rows]))
