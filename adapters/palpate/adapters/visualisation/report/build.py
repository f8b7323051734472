"""From a folder to a page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

from palpate.adapters.visualisation.report.compare_page import compare_page
from palpate.adapters.visualisation.report.explore_page import explore_page
from palpate.adapters.visualisation.report.infer_page import infer_page
from palpate.adapters.visualisation.report.kinds import FolderKind, kind_of
from palpate.adapters.visualisation.report.page import Page
from palpate.adapters.visualisation.report.run_page import run_page
from palpate.adapters.visualisation.report.study_page import study_page

_PAGES: Final[dict[FolderKind, Callable[..., Page]]] = {
    FolderKind.RUN: run_page,
    FolderKind.COMPARE: compare_page,
    FolderKind.EXPLORE: explore_page,
    FolderKind.INFER: infer_page,
    FolderKind.STUDY: study_page,
}


def page_of(folder: Path, *, logs: bool = True) -> Page:
    """The page of a result folder; equal folders give equal pages.

    Args:
        folder: The folder of a run, a comparison, an exploration, an inference or a study.
        logs: Whether to read logs, for forces and timing.

    Raises:
        OutputError: It is no such folder, nothing in it is finished, or a file in it is damaged.
        ConfigurationError: A policy or an automaton in it is damaged.
        LogError: A log is torn or damaged.
    """
    # The last part of the name only: the same folder at another place gives the same bytes.
    return _PAGES[kind_of(folder)](folder, folder.resolve().name or "report", logs=logs)
