"""What is written into a picture, and where. No graphics library is needed."""

from collections.abc import Sequence
from functools import cache
from math import hypot
from pathlib import Path
from typing import Final

from PIL import Image, ImageDraw, ImageFont

from palpate.adapters.log import TrialLog
from palpate.adapters.mujoco import ACTION, FORCE, Moment
from palpate.adapters.visualisation.film.course import Course

LINES: Final = 24
"""So many lines of text would fill a picture from top to bottom."""
SMALLEST_PX: Final = 7
_NOTHING: Final = "-"
_INK: Final = (24, 32, 42)
_PALE_INK: Final = (90, 100, 112)
_PAPER: Final = (255, 255, 255, 190)
_INKS: Final = {"action": ACTION, "force": FORCE, "x y z": FORCE}
"""What an arrow shows is written in the arrow's colour."""


@cache
def font(size_px: int, *, bold: bool = False) -> ImageFont.FreeTypeFont:
    """DejaVu Sans as Matplotlib brings it along: the same letters on every machine."""
    from matplotlib import get_data_path

    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(get_data_path(), "fonts", "ttf", name)), size_px)


def font_px(width: int, height: int) -> int:
    """Size of the letters in a picture of this size."""
    return max(round(min(height, width * 0.75) / LINES * 0.8), SMALLEST_PX)


def now_lines(moment: Moment, force_N: Sequence[float] | None) -> list[tuple[str, str]]:
    """The captions of a moment: names and values, a line each.

    Args:
        force_N: The measured force in the task frame, (3,); None where none was measured.
    """
    lines = [("time", f"{moment.time_s:.2f} s"), ("phase", moment.phase)]
    decision = moment.decision
    lines += [
        ("symbol", _NOTHING if decision is None else decision.symbol),
        ("state", _NOTHING if decision is None else decision.state),
        ("action", _NOTHING if decision is None else _action(decision.action, decision.source)),
    ]
    if force_N is None:
        lines += [("force", "not measured"), ("x y z", _NOTHING)]
    else:
        x, y, z = (round(value, 1) + 0.0 for value in force_N)
        lines.append(("force", f"{hypot(*force_N):.1f} N"))
        lines.append(("x y z", f"{x:+.1f} {y:+.1f} {z:+.1f} N"))
    return lines


def title_of(log: TrialLog) -> str:
    """Which trial this is."""
    start = log.start
    policy = "learned policy" if start.policy == "document" else start.policy
    return f"{Path(log.path).stem}: {start.arm}, {policy}"


def outcome_of(log: TrialLog) -> str:
    """What the trial came to; empty where the log does not hold it."""
    if log.end is None:
        return ""
    return f"ended: {log.end.error}" if log.end.error else log.end.outcome


def notes_of(course: Course, *, hole_known: bool, world: str, part: str = "hole") -> list[str]:
    """Limits of the picture that a viewer must see: what is drawn from assumptions."""
    if hole_known:
        notes = [f"{part}: where the {world} had it"]
    else:
        notes = [f"{part}: where it is believed to be"]
    if not course.tared:
        notes.append("force: raw, weight included")
    return notes


def write_block(picture: Image.Image, corner: tuple[float, float], lines: list[tuple[str, str]], size_px: int) -> None:
    """Write names and values on a light ground."""
    name_font, value_font = font(size_px), font(size_px, bold=True)
    step, pad = line_px(size_px), size_px * 0.6
    indent = max(name_font.getlength(name) for name, _ in lines) + 0.7 * size_px
    width = indent + max(value_font.getlength(value) for _, value in lines) + 2 * pad
    x, y = corner
    draw = ImageDraw.Draw(picture, "RGBA")
    draw.rounded_rectangle((x, y, x + width, y + step * len(lines) + 2 * pad * 0.7), size_px * 0.4, fill=_PAPER)
    for row, (name, value) in enumerate(lines):
        top = y + 0.7 * pad + row * step
        draw.text((x + pad, top), name, font=name_font, fill=_PALE_INK)
        draw.text((x + pad + indent, top), value, font=value_font, fill=_INKS.get(name, _INK))


def write_line(picture: Image.Image, corner: tuple[float, float], text: str, size_px: int, anchor: str = "la") -> None:
    """Write one line on a light ground; ``anchor`` as Pillow has it."""
    draw = ImageDraw.Draw(picture, "RGBA")
    box = draw.textbbox(corner, text, font=font(size_px), anchor=anchor)
    pad = size_px * 0.35
    draw.rounded_rectangle((box[0] - pad, box[1] - pad, box[2] + pad, box[3] + pad), size_px * 0.3, fill=_PAPER)
    draw.text(corner, text, font=font(size_px), fill=_INK, anchor=anchor)


def line_px(size_px: int) -> float:
    """From one line to the next."""
    return size_px * 1.32


def _action(action: str, source: str) -> str:
    return action if action == source else f"{action} ({source})"
