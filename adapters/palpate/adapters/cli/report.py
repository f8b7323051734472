"""The ``palpate report`` command."""

import os
import sys
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import tyro

from palpate.adapters.files import write_whole
from palpate.core.errors import OutputError
from palpate.core.ports import Settings


@dataclass(frozen=True)
class ReportOptions(Settings):
    """Create a self-contained HTML page about a run or a study, FOLDER/report.html. An older report is replaced."""

    folder: Annotated[str, tyro.conf.Positional]
    """Run or study folder."""
    logs: bool = True
    """Read a run's logs to show the forces in individual trials."""


def report(options: ReportOptions) -> int:
    """Create the page for a folder, and return the exit code."""
    folder = Path(options.folder)
    study, run = os.path.exists(folder / "study.toml"), os.path.exists(folder / "run.toml")
    if not study and not (run and os.path.exists(folder / "trials.csv")):
        raise OutputError(str(folder), "is not a folder of palpate train, run or study", "name one of these")
    # Imported here, because the plotting libraries take a second to load.
    from palpate.adapters.visualisation.report import PAGE, html_of, require_free, run_page, study_page

    require_free(folder / PAGE)
    page = study_page(folder) if study else run_page(folder, logs=options.logs)
    html = html_of(page, version("palpate"))
    write_whole(folder / PAGE, html)
    sys.stdout.write(f"{len(html) / 1e6:.1f} MB in {folder / PAGE}\n")
    return 0
