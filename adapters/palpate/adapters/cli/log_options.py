"""Command-line options of ``palpate log``. Light to import, as :mod:`.options` is."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from palpate.core.ports import Settings

Files = Annotated[tuple[str, ...], tyro.conf.Positional]


@dataclass(frozen=True)
class InfoOptions(Settings):
    """Tell what logs hold: what of, how fast, how whole, and what came of it."""

    files: Files = ()
    """Logs, or folders with logs in or below them; a page for one, a table for several."""
    json: bool = False
    """Everything about every log, as a JSON list."""


@dataclass(frozen=True)
class PlotOptions(Settings):
    """Draw a trial over time: forces, torques, position, states, actions, events."""

    file: Annotated[str, tyro.conf.Positional]
    """The log."""
    out: str = ""
    """The figure, a new .png, .svg or .pdf file; NAME.png beside the log if not given."""


@dataclass(frozen=True)
class ExportOptions(Settings):
    """Write logs in another format: csv keeps every bit.

    rerun is what palpate run --live shows: frames, scene and values. Foxglove opens the logs themselves.
    """

    files: Files = ()
    """Logs, or folders with logs in or below them."""
    to: str = ""
    """csv, or rerun (RRD)."""
    out: str = ""
    """Folder for the result; it must be new or empty."""
