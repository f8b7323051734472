"""Command-line options of ``palpate log``. Light to import, as :mod:`.options` is."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from palpate.core.ports import Range, Settings

VIEWERS = ("foxglove", "rerun")
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
    """The picture, a PNG file that is not there yet; beside the log if not given."""


@dataclass(frozen=True)
class ExportOptions(Settings):
    """Write logs in another format: csv keeps every bit, lerobot resamples to frames of a fixed rate.

    foxglove and rerun get what palpate run --live shows: frames, scene and values, to be opened as a picture.
    """

    files: Files = ()
    """Logs, or folders with logs in or below them."""
    to: str = ""
    """csv, lerobot (LeRobotDataset v3.0, one episode a log), foxglove (MCAP) or rerun (RRD)."""
    out: str = ""
    """Folder for the result; it must be new or empty."""
    fps: Annotated[int, Range(1, 10_000)] | None = None
    """Frames per second, for lerobot only; 140, the control rate, if not given."""


@dataclass(frozen=True)
class ImportOptions(Settings):
    """Take the examples out of a LeRobot dataset that palpate exported: decisions of episodes that came to success."""

    folder: Annotated[str, tyro.conf.Positional]
    """The dataset."""
    out: str = ""
    """The examples, a CSV file that is not there yet, for palpate train --learning.examples; examples.csv if not
    given."""


@dataclass(frozen=True)
class RecoverOptions(Settings):
    """Write a sound log of what is left of a torn or damaged one."""

    file: Annotated[str, tyro.conf.Positional]
    """The torn or damaged log; it is not changed."""
    out: str = ""
    """The sound log, a file that is not there yet; NAME.recovered.mcap beside it if not given."""
