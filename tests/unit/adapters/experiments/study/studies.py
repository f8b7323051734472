"""Studies for tests."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from palpate.adapters.experiments.study import CellJob, Study, StudyCell


def study_of(text: str, folder: Path) -> Study:
    """The study in a text."""
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return Study.read(path)


def job_in(folder: Path, cell: StudyCell, base: Mapping[str, Any] | None = None, **others: Any) -> CellJob:
    """A job for a cell, quick unless the base says otherwise."""
    facts: dict[str, Any] = {"trials": 1, "files": {}, "relative_to": str(folder), **others}
    return CellJob(str(folder), cell, {"task.time_limit_s": 0.1} if base is None else base, **facts)
