"""What kind of result folder a folder is."""

from __future__ import annotations

import enum
import os
from pathlib import Path

from palpate.adapters.visualisation.report.files import is_there, read_run_toml
from palpate.core.errors import OutputError


class FolderKind(enum.Enum):
    """The command that made a folder."""

    RUN = "run"
    """``palpate train`` or ``palpate run``."""
    COMPARE = "compare"
    EXPLORE = "explore"
    INFER = "infer"
    STUDY = "study"


def kind_of(folder: Path) -> FolderKind:
    """Tell it by its files.

    Raises:
        OutputError: There is no such folder, or no command of palpate leaves one like it.
    """
    if not is_there(folder):
        raise OutputError(str(folder), "is not there", "name the folder of a run or of a study")
    if not os.path.isdir(folder):
        raise OutputError(str(folder), "is a file, not a folder", "name the folder of a run or of a study")
    has = set(os.listdir(folder))
    if "study.toml" in has or ("cells" in has and os.path.isdir(folder / "cells")):
        return FolderKind.STUDY
    if {"automaton.json", "report.json"} <= has:
        return FolderKind.INFER
    if {"summary.json", "trials.csv", "table.txt"} <= has and "run.toml" not in has:
        return FolderKind.EXPLORE
    if "compare.csv" in has:
        return FolderKind.COMPARE
    if "run.toml" in has and read_run_toml(folder)[1].get("command") == "compare":
        raise OutputError(str(folder), "is of a comparison that has not come to its end", "let palpate compare finish")
    if "trials.csv" in has or "run.toml" in has:
        return FolderKind.RUN
    raise OutputError(
        str(folder),
        "is no folder that palpate left",
        "name one of palpate train, run, compare, explore, infer or study",
    )
