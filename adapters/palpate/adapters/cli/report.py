"""``palpate report``. Light to import: what draws is loaded when it is known that there is something to draw."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from palpate.core.ports import Settings


@dataclass(frozen=True)
class ReportOptions(Settings):
    """Make one page about a run or a study: FOLDER/report.html, which needs no network and nothing beside it.

    Its pictures, and its figures as summary.csv, go to FOLDER/report. An older report of palpate's is replaced.
    """

    folder: Annotated[str, tyro.conf.Positional]
    """Folder that palpate train, run, compare or study left."""
    logs: bool = True
    """Read logs too, for forces and timing of the cycle."""
    overwrite: bool = False
    """Replace files in the way that palpate report did not make."""


def report(options: ReportOptions) -> int:
    """Make the page of a folder; returns the exit code."""
    folder = Path(options.folder)
    from palpate.adapters.visualisation.report import FOLDER, PAGE, maker_of, place, require_placeable

    maker_of(folder)
    require_placeable(folder, overwrite=options.overwrite)
    from importlib.metadata import version

    from palpate.adapters.visualisation.report import csv_of, html_of, page_of

    page = page_of(folder, logs=options.logs)
    files = {f"{picture.name}.png": picture.png for picture in page.pictures}
    files["summary.csv"] = csv_of(page).encode("utf-8")
    html = html_of(page, version("palpate"))
    place(folder, html, files, overwrite=options.overwrite)
    sys.stdout.write("".join(f"mind: {notice}\n" for notice in page.notices))
    sys.stdout.write(
        f"{page.kind}: {len(page.pictures)} pictures, {len(html) / 1e6:.1f} MB, in {folder / PAGE}\n"
        f"pictures and summary.csv in {folder / FOLDER}\n"
    )
    return 0
