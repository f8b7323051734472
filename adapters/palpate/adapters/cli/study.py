"""``palpate study``."""

from __future__ import annotations

import os
import shlex
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from palpate.adapters.cli.notices import print_weakened, say, watched
from palpate.adapters.cli.progress import progress
from palpate.adapters.cli.study_options import StudyOptions
from palpate.adapters.experiments import RunFolder
from palpate.adapters.experiments.study import (
    MOST_CELLS,
    CellJob,
    CellOutcome,
    CellReport,
    Engine,
    Processes,
    Sequential,
    Study,
    StudyCell,
    StudyFolder,
    digest_of,
    require_possible,
)
from palpate.core.errors import ConfigurationError, UsageError, require_one_of

if TYPE_CHECKING:
    from palpate.adapters.visualisation.live import LiveView

_MANY: Final = 1000
"""A study of more cells is asked about before it begins."""
_MOST_LINES: Final = 20
_BYTES_PER_CELL: Final = 60_000
_BYTES_PER_TRIAL: Final = 2_000
_BYTES_PER_LOG: Final = 200_000
_ENGINES: Final = ("sequential", "processes")


def study(options: StudyOptions) -> int:
    """Make every cell of a study that is not finished; returns the exit code."""
    require_one_of("engine", options.engine, _ENGINES)
    file = Path(options.file)
    asked, folder = Study.read(file), StudyFolder(Path(options.out or f"runs/{file.stem}"))
    if asked.count > MOST_CELLS:
        raise ConfigurationError("study", f"{asked.count} cells", f"at most {MOST_CELLS}")
    size = _size(asked, folder)
    _permit(asked, folder, size, options.yes)
    files = {path: digest_of(path) for path in sorted(asked.files())}
    require_possible(asked)
    engine = Sequential() if options.engine == "sequential" else Processes(options.jobs or os.cpu_count() or 1)
    cells = list(asked.cells())
    folder.require_fits(asked, cells, files)
    folder.finished(cells)
    with watched(options) as live, folder.opened(asked, files):
        print_weakened(asked.config(next(asked.settings())))
        say(size)
        finished = folder.finished(cells)
        for cell in folder.clear(cells, finished):
            sys.stderr.write(f"palpate: {cell} was begun and not finished: it is made anew\n")
        if finished:
            say(f"{len(finished)} of them are finished already")
        jobs = jobs_of(asked, folder, [cell for cell in cells if cell.name not in finished], files)
        progress = CellProgress(len(cells), len(finished), lambda name: _show(live, folder, name))
        try:
            progress.follow(engine, jobs)
        finally:
            # What workers left that died, or that were ended now.
            folder.clear(cells, folder.finished(cells))
            whole = folder.write_table(asked, cells)
    return _end(options, folder, progress, whole, len(cells))


def _size(asked: Study, folder: StudyFolder) -> str:
    recorded = asked.base.get("recording.enabled", False)
    cell = _BYTES_PER_CELL + asked.trials * (_BYTES_PER_TRIAL + recorded * _BYTES_PER_LOG)
    total = asked.count * cell * 1e-6
    text = f"{total / 1e3:.1f} GB" if total >= 1e3 else f"{max(total, 0.1):.1f} MB"
    logs = "with" if recorded else "without"
    return f"{asked.count} cells of {asked.trials} trials in {folder.path}, about {text} {logs} logs"


def _permit(asked: Study, folder: StudyFolder, size: str, yes: bool) -> None:
    """Ask before a study with many cells still to be made."""
    if asked.count - folder.count() <= _MANY or yes:
        return
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise UsageError(f"{size}: more than {_MANY} are made only with --yes")
    sys.stderr.write(f"{size}\nbegin? [y/N] ")
    sys.stderr.flush()
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise UsageError("not begun")


def jobs_of(
    asked: Study, folder: StudyFolder, cells: Sequence[StudyCell], files: Mapping[str, str]
) -> Iterator[CellJob]:
    """What is to be made of each cell."""
    path, here = os.path.abspath(folder.cells), os.getcwd()
    return (CellJob(path, cell, asked.base, asked.trials, files, here, asked.job) for cell in cells)


class CellProgress:
    """The cells that are made, under a progress bar with the time left; what goes wrong stands above it."""

    def __init__(self, total: int, finished: int, made: Callable[[str], object] = len) -> None:
        self._total, self._finished, self._made = total, finished, made
        self.failed: list[CellReport] = []
        self.interrupted = False

    def follow(self, engine: Engine, jobs: Iterator[CellJob]) -> None:
        """Make the cells, until all are made or Ctrl-C ends it."""
        with (
            progress(self._total, "cell", initial=self._finished) as bar,
            closing(engine.run(jobs)) as reports,
        ):
            try:
                for report in reports:
                    self._note(report, bar)
            except KeyboardInterrupt:
                self.interrupted = True

    def _note(self, report: CellReport, bar: Any) -> None:
        if report.outcome is CellOutcome.DIED:
            bar.write(f"palpate: a worker died over {report.name}: it is made anew", file=sys.stderr)
        elif report.outcome is CellOutcome.FAILED:
            self.failed.append(report)
            if len(self.failed) <= _MOST_LINES:
                bar.write(f"palpate: {report.name} failed: {report.problem}", file=sys.stderr)
        else:
            bar.update()
            self._made(report.name)


def _show(live: LiveView | None, folder: StudyFolder, name: str) -> None:
    """Workers have no view of their own: many arms at once would be none to look at. Cells are shown as they come."""
    if live is not None:
        live.note(time.monotonic_ns(), f"{name} is finished", RunFolder(folder.cells / name).read_trials(), name)


def _end(options: StudyOptions, folder: StudyFolder, progress: CellProgress, whole: int, total: int) -> int:
    say(f"{whole} of {total} cells are finished; table in {folder.path / 'summary.csv'}")
    if progress.failed:
        say(f"{len(progress.failed)} cells failed")
    if progress.interrupted:
        again = ["palpate", "study", options.file, "--out", str(folder.path)]
        say(f"ended early; go on with: {shlex.join(again)}")
        return 130
    return 1 if progress.failed else 0
