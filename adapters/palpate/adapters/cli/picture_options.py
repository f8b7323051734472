"""Command-line options of ``palpate render``. Light to import, as :mod:`.options` is."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from palpate.core.ports import Range, Settings


@dataclass(frozen=True)
class RenderOptions(Settings):
    """Draw a recorded trial as a film (.mp4, .gif).

    The arm stands as its encoders told, and an arrow shows the measured force at the tip. Symbol, state, action, time
    and phase are written in. Needs no display; the graphics library is EGL or OSMesa, MUJOCO_GL chooses.
    """

    log: Annotated[str, tyro.conf.Positional]
    """The log."""
    to: str = ""
    """The file to make, ending with .mp4 or .gif; it must not be there yet."""
    camera: str = "both"
    """close-up (plate cut open), arm (all of it), or both (the arm in a corner of the close-up)."""
    size: str = ""
    """WIDTHxHEIGHT in pixels; 640x480 if not given."""
    fps: Annotated[float, Range(0.1, 240.0, text="a number from 0.1 to 240, for .gif from 0.1 to 50")] | None = None
    """Pictures per second; 25 if not given, 12.5 for .gif."""
    speed: Annotated[float, Range(0.001, 1000.0)] = 1.0
    """Seconds of the trial per second of the film: 0.5 shows it at half its speed."""
    begin_s: float | None = None
    """Where to begin, in seconds of the trial; with the trial if not given."""
    end_s: float | None = None
    """Where to end; with the trial if not given."""
