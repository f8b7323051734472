"""From a result folder to a page."""

import os
from collections.abc import Callable
from pathlib import Path

from palpate.adapters.visualisation.report.compare_page import compare_page
from palpate.adapters.visualisation.report.files import is_there, read_run_toml
from palpate.adapters.visualisation.report.page import Page
from palpate.adapters.visualisation.report.run_page import run_page
from palpate.adapters.visualisation.report.study_page import study_page
from palpate.core.errors import OutputError


def maker_of(folder: Path) -> Callable[..., Page]:
    """What makes the page of a folder, by the files in it.

    Raises:
        OutputError: There is no such folder, or no command of palpate leaves one like it.
    """
    if not is_there(folder):
        raise OutputError(str(folder), "is not there", "name the folder of a run or of a study")
    if not os.path.isdir(folder):
        raise OutputError(str(folder), "is a file, not a folder", "name the folder of a run or of a study")
    has = set(os.listdir(folder))
    if "study.toml" in has or ("cells" in has and os.path.isdir(folder / "cells")):
        return study_page
    if "compare.csv" in has:
        return compare_page
    if "run.toml" in has and read_run_toml(folder)[1].get("command") == "compare":
        raise OutputError(str(folder), "is of a comparison that has not come to its end", "let palpate compare finish")
    # A run in a grid world has its trials in a table too, and no settings of an arm.
    if "run.toml" in has or ("trials.csv" in has and "table.txt" not in has):
        return run_page
    raise OutputError(
        str(folder), "is no folder that a report can be made of", "name one of palpate train, run, compare or study"
    )


def page_of(folder: Path, *, logs: bool = True) -> Page:
    """The page of a result folder; equal folders give equal pages. Logs are read for forces and timing.

    Raises:
        OutputError: It is no such folder, nothing in it is finished, or a file in it is damaged.
        ConfigurationError: A policy or an automaton in it is damaged.
        LogError: A log is torn or damaged.
    """
    # The last part of the name only: the same folder at another place gives the same bytes.
    return maker_of(folder)(folder, folder.resolve().name or "report", logs=logs)
