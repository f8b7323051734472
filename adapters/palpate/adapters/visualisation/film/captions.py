"""What is written into a picture, and where. No graphics library is needed."""

from collections.abc import Sequence
from functools import cache
from math import hypot
from pathlib import Path
from typing import Final

from PIL import Image, ImageDraw, ImageFont

from palpate.adapters.log import TrialLog
from palpate.adapters.mujoco import Moment

_LINES: Final = 30
"""This many lines of text would fill a picture from top to bottom."""
_SMALLEST_PX: Final = 7
_INK: Final = (24, 32, 42)
_PAPER: Final = (255, 255, 255, 190)


@cache
def _font(size_px: int) -> ImageFont.FreeTypeFont:
    """DejaVu Sans Mono as Matplotlib brings it along: the same letters on every machine."""
    from matplotlib import get_data_path

    return ImageFont.truetype(str(Path(get_data_path(), "fonts", "ttf", "DejaVuSansMono.ttf")), size_px)


def now_text(moment: Moment, force_N: Sequence[float] | None) -> str:
    """Return the caption of a moment: names and values, a line each.

    Args:
        force_N: The measured force in the task frame, (3,); None where none was measured.
    """
    decision, force, parts = moment.decision, "not measured", "-"
    if force_N is not None:
        x, y, z = (round(value, 1) + 0.0 for value in force_N)
        force, parts = f"{hypot(*force_N):.1f} N", f"{x:+.1f} {y:+.1f} {z:+.1f} N"
    named = {
        "time": f"{moment.time_s:.2f} s", "phase": moment.phase, "symbol": decision.symbol if decision else "-",
        "state": decision.state if decision else "-",
        "action": f"{decision.action} ({decision.source})" if decision else "-", "force": force, "x y z": parts,
    }  # fmt: skip
    return "\n".join(f"{name:<7}{value}" for name, value in named.items())


def title_of(log: TrialLog) -> str:
    """Return which trial this is."""
    start = log.start
    return f"{Path(log.path).stem}: {start.arm}, {'learned policy' if start.policy == 'document' else start.policy}"


def outcome_of(log: TrialLog) -> str:
    """Return the outcome of a trial; empty where the log does not hold it."""
    if log.end is None:
        return ""
    return f"ended: {log.end.error}" if log.end.error else log.end.outcome


def notes_of(*, tared: bool, hole_known: bool, world: str, part: str = "hole") -> list[str]:
    """Return limits of the picture that a viewer must see: what is drawn from assumptions."""
    place = f"{part}: where the {world} had it" if hole_known else f"{part}: where it is believed to be"
    return [place] if tared else [place, "force: raw, weight included"]


def write(picture: Image.Image, place: tuple[float, float], text: str, anchor: str) -> None:
    """Write lines on a light ground; place as shares of width and height, ``anchor`` as Pillow has it."""
    width, height = picture.size
    size_px = max(round(min(height, width * 0.75) / _LINES), _SMALLEST_PX)
    corner, pad, draw = (place[0] * width, place[1] * height), size_px * 0.4, ImageDraw.Draw(picture, "RGBA")
    align = "right" if anchor[0] == "r" else "left"
    box = draw.multiline_textbbox(corner, text, _font(size_px), anchor, align=align)
    draw.rounded_rectangle((box[0] - pad, box[1] - pad, box[2] + pad, box[3] + pad), pad, fill=_PAPER)
    draw.multiline_text(corner, text, _INK, _font(size_px), anchor, align=align)
