"""The ``palpate study`` command."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import closing
from pathlib import Path
from typing import Any, Final

from palpate.adapters.cli.notices import say
from palpate.adapters.cli.options import StudyOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.experiments import Workers, completed, workers_for
from palpate.adapters.experiments.study import Condition, Study, StudyFolder, make
from palpate.adapters.log import counted
from palpate.core.errors import OutputError, PalpateError, UsageError, one_line

_MOST_LINES: Final = 20


def study(options: StudyOptions) -> int:
    """Run every unfinished condition in a study, and return the exit code."""
    file = Path(options.file)
    requested, folder = Study.read(file), StudyFolder(Path(options.out or f"runs/{file.stem}"))
    conditions = list(requested.conditions())
    for condition in conditions[:: len(requested.seeds)]:
        condition.require_possible()
    failed, interrupted = 0, False
    with closing(_workers(options)) as workers, folder.writing(file, requested.job, conditions) as missing:
        finished = len(conditions) - len(missing)
        each = counted(requested.trials, "trial")
        say(f"{counted(len(conditions), 'condition')} of {each} in {folder.path}; finished: {finished}")
        try:
            with progress(len(conditions), "condition", initial=finished) as bar:
                failed = _run(workers, folder, missing, bar)
        except KeyboardInterrupt:
            interrupted = True
        finally:
            workers.close()
            finished = folder.write_table(requested, conditions)
    say(f"finished: {finished} of {counted(len(conditions), 'condition')}; table in {folder.path / 'summary.csv'}")
    if failed:
        say(f"{counted(failed, 'condition')} failed")
    if interrupted:
        again = ["palpate", "study", options.file, "--out", str(folder.path)]
        say(f"ended early; continue with: {shlex.join(again)}")
        return 130
    return 1 if failed else 0


def _workers(options: StudyOptions) -> Workers:
    jobs = options.jobs or os.cpu_count() or 1
    if options.scheduler:
        from palpate.adapters.experiments.study import LOCAL, DaskWorkers

        workers = DaskWorkers(options.scheduler, jobs)
        if options.scheduler == LOCAL:
            say(f"dashboard: {workers.dashboard}")
        return workers
    return workers_for(jobs)


def _run(workers: Workers, folder: StudyFolder, missing: Sequence[Condition], bar: Any) -> int:
    """Run conditions, print the failures, and return the number of failures."""
    failed = 0
    calls: Iterable[tuple[Condition, Path]] = ((condition, folder.conditions) for condition in missing)
    for number, done in completed(workers, make, calls):
        try:
            done.result()
            bar.update()
        except (OutputError, UsageError):
            raise
        except OSError as error:
            problem = f"cannot be written ({error.strerror or error})"
            remedy = "make room and run the same command again: it continues"
            raise OutputError(str(error.filename or folder.path), problem, remedy) from error
        except (PalpateError, BrokenExecutor) as error:
            failed += 1
            if failed <= _MOST_LINES:
                problem = "two workers died over it" if isinstance(error, BrokenExecutor) else one_line(error)
                bar.write(f"palpate: {missing[number].name} failed: {problem}", file=sys.stderr)
    return failed
