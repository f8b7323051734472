"""Command-line options of ``palpate render`` and ``palpate view``. Light to import, as :mod:`.options` is."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import tyro

from palpate.adapters.cli.options import Flat
from palpate.adapters.config.run import RunConfig


@dataclass(frozen=True)
class RenderOptions:
    """Draw a recorded trial: a film (.mp4, .gif), or a sheet of pictures (.png).

    The arm stands as its encoders told, and an arrow shows the measured force at the tip. Symbol, state, action, time
    and phase are written in. Needs no display; the graphics library is EGL or OSMesa, MUJOCO_GL chooses.
    """

    log: Annotated[str, tyro.conf.Positional]
    """The log."""
    to: str = ""
    """The file to make, ending with .mp4, .gif or .png; it must not be there yet."""
    camera: str = "both"
    """close-up (plate cut open), arm (all of it), or both (the arm in a corner of the close-up)."""
    size: str = ""
    """WIDTHxHEIGHT in pixels; 640x480 if not given, 1440x760 for .png."""
    fps: float | None = None
    """Pictures per second; 25 if not given, 12.5 for .gif."""
    speed: float = 1.0
    """Seconds of the trial per second of the film: 0.5 shows it at half its speed."""
    begin_s: float | None = None
    """Where to begin, in seconds of the trial; a film begins with it, a sheet with the approach, if not given."""
    end_s: float | None = None
    """Where to end; with the trial if not given."""
    pictures: int = 6
    """How many pictures of a sheet (.png), evenly spread over the time; 1 shows the end."""


@dataclass(frozen=True)
class ViewOptions:
    """Watch trials in the simulator, in MuJoCo's viewer and in real time. Nothing is recorded and nothing learned."""

    run: Flat = field(default_factory=RunConfig)
    policy: str = ""
    """A policy file, or omniscient, torque, spiral-10, spiral-5, random."""
    trials: int = 10
    """Number of trials; closing the window ends earlier."""
    speed: float = 1.0
    """Seconds of the trial per second: 0.5 shows it at half its speed."""
    config: str = ""
    """TOML file with any of the settings below (a run.toml too); flags win over it."""
