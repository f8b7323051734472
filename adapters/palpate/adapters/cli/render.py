"""The ``palpate render`` command."""

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import tyro

from palpate.adapters.cli.log import print_damage
from palpate.core.errors import ConfigurationError, require_in, require_one_of
from palpate.core.ports import Range, Settings

ENDINGS: Final = (".mp4", ".gif")
LEAST_PX: Final = 120
"""Minimum size of a picture; smaller pictures have no room for text."""
_MOST_PX: Final = 4096
_GIF_MOST: Final = 2_000
_MP4_MOST: Final = 20_000
_GIF_MOST_FPS: Final = 50.0


@dataclass(frozen=True)
class RenderOptions(Settings):
    """Draw a recorded trial as a video (.mp4, .gif).

    The arm follows the recorded encoders, and an arrow shows the measured force at the tip. A caption shows the symbol,
    state, action, time and phase. No display is needed; MUJOCO_GL selects EGL or OSMesa.
    """

    log: Annotated[str, tyro.conf.Positional]
    """Log to draw."""
    to: str = ""
    """New file for the video, .mp4 or .gif."""
    camera: str = "both"
    """View: close-up (with a section of the plate), arm (whole arm), or both (the arm in a corner of the close-up)."""
    size: str = ""
    """Size in pixels, WIDTHxHEIGHT. Default: 640x480."""
    fps: Annotated[float, Range(0.1, 240.0, text="a number from 0.1 to 240, for .gif from 0.1 to 50")] | None = None
    """Frames per second. Default: 25, or 12.5 for .gif."""
    speed: Annotated[float, Range(0.001, 1000.0)] = 1.0
    """Video speed: 0.5 shows the trial at half speed."""
    begin_s: float | None = None
    """Start of the video, in seconds of trial time. Default: start of the trial."""
    end_s: float | None = None
    """End of the video, in seconds of trial time. Default: end of the trial."""


def render(options: RenderOptions) -> int:
    """Render a log to a file, and return the exit code."""
    out, ending = Path(options.to), Path(options.to).suffix.lower()
    options.require("to", ending in ENDINGS, f"a file that ends with {' or '.join(ENDINGS)}")
    is_gif = ending == ".gif"
    with _mujoco_without_graphics():
        from palpate.adapters.mujoco import CAMERAS
        from palpate.adapters.visualisation.video import Painter, require_video, trajectory_of, write_gif, write_mp4
    require_one_of("camera", options.camera, CAMERAS)
    size = _size(options.size)
    options.require("size", is_gif or not (size[0] % 2 or size[1] % 2), "two even numbers for .mp4")
    fps = (12.5 if is_gif else 25.0) if options.fps is None else options.fps
    require_in("fps", fps, 0.1, _GIF_MOST_FPS if is_gif else 240.0)
    from tqdm import tqdm

    from palpate.adapters.files import new_file, require_no_file
    from palpate.adapters.log import read_log

    require_no_file(out, "--to")
    log = read_log(options.log)
    print_damage(log)
    if not is_gif:
        require_video()
    trajectory = trajectory_of(log)
    stretch = trajectory.stretch(options.begin_s, options.end_s)
    moments = trajectory.film(*stretch, fps, options.speed, _GIF_MOST if is_gif else _MP4_MOST)
    with new_file(out, "--to") as passing, Painter(log, trajectory, size, options.camera) as painter:
        pictures = map(painter.paint, tqdm(moments, unit="picture", file=sys.stderr, leave=False, disable=None))
        if is_gif:
            write_gif(passing, pictures, fps, len(moments))
        else:
            write_mp4(passing, pictures, fps)
    sys.stdout.write(
        f"{len(moments)} pictures of {stretch[0]:.2f} to {stretch[1]:.2f} s of the trial in {out},"
        f" {os.path.getsize(out) / 1e6:.2f} MB\n"
    )
    return 0


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,6})x(\d{1,6})", text or "640x480")
    if match is None:
        raise ConfigurationError("size", text, "WIDTHxHEIGHT in pixels, as in 640x480")
    width, height = int(match[1]), int(match[2])
    if not (LEAST_PX <= width <= _MOST_PX and LEAST_PX <= height <= _MOST_PX):
        raise ConfigurationError("size", text, f"{LEAST_PX} to {_MOST_PX} pixels each way")
    return width, height


@contextmanager
def _mujoco_without_graphics() -> Iterator[None]:
    """Context in which importing MuJoCo loads no OpenGL backend, because a working one is selected later."""
    before = dict(os.environ)
    os.environ["MUJOCO_GL"] = "off"
    try:
        yield
    finally:
        del os.environ["MUJOCO_GL"]
        os.environ.update(before)
