"""Whole run folders: whether all is there that belongs to a run, and nothing else."""

import os
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from palpate.adapters.experiments import MANIFEST, RunFolder, read_manifest
from palpate.adapters.log import LOG_FOLDER, trial_name
from palpate.core.errors import OutputError

_SIGNS: Final = (MANIFEST, "run.toml", "trials.csv")
"""What shows that a folder is that of a run; the last of them only beside logs."""


@dataclass
class FolderFindings:
    """What was found in run folders."""

    problems: list[str] = field(default_factory=list)
    notices: list[str] = field(default_factory=list)


def judge_folders(names: Sequence[str]) -> FolderFindings:
    """Hold every run folder that is named, or lies below a named one, against its manifest.

    Raises:
        OutputError: A manifest cannot be read, or is that of another run.
    """
    found = FolderFindings()
    for folder in _run_folders(names):
        manifest = read_manifest(folder)
        if manifest is None:
            found.problems.append(f"{folder / MANIFEST}: is missing")
            try:
                trials = [row.trial for row in RunFolder(folder).read_trials()]
            except OutputError as error:
                found.problems.append(str(error))
            else:
                found.problems += _missing_logs(folder, trials)
            continue
        found.problems += manifest.problems(folder)
        if manifest.finished and (folder / "trials.csv").is_file():
            with suppress(OutputError):
                rows = RunFolder(folder).read_trials()
                if len(rows) != manifest.trials:
                    told = f"tells of {manifest.trials} trials, trials.csv of {len(rows)}"
                    found.problems.append(f"{folder / MANIFEST}: {told}")
                # Trials are counted from 0; one that left no line has left its log.
                gone = _missing_logs(folder, range(max((row.trial for row in rows), default=-1) + 1))
                found.problems += [line for line in gone if line not in found.problems]
        if not manifest.finished:
            # The log of the newest trial need not have been begun when the run was cut short.
            gone = _missing_logs(folder, range(manifest.trials - 1))
            found.problems += [line for line in gone if line not in found.problems]
            found.notices.append(
                f"{folder} is of a run that is under way, or was cut short after {manifest.trials} trials"
            )
    return found


def _run_folders(names: Sequence[str]) -> list[Path]:
    folders: dict[Path, None] = {}
    for name in filter(os.path.isdir, names):
        top = Path(name)
        above = [top.parent] if top.name == LOG_FOLDER else []
        below = sorted({path.parent for sign in _SIGNS for path in top.rglob(sign)})
        folders.update((folder, None) for folder in (*above, *below) if _is_run(folder))
    return list(folders)


def _is_run(folder: Path) -> bool:
    *sure, table = (os.path.lexists(folder / sign) for sign in _SIGNS)
    return any(sure) or (table and (folder / LOG_FOLDER).is_dir())


def _missing_logs(folder: Path, trials: Iterable[int]) -> list[str]:
    """Logs of these trials that are not there, though there are others."""
    logs = folder / LOG_FOLDER
    there = {path.stem for path in logs.glob("*.mcap")}
    gone = [logs / f"{trial_name(trial)}.mcap" for trial in trials if trial_name(trial) not in there]
    return [f"{path}: is missing" for path in gone] if there else []
