"""Picture of a trial, with the cell, the force at the tip, and the core's state and action."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import dist, hypot
from pathlib import Path
from typing import Final

import numpy as np
from PIL import Image, ImageDraw, ImageFont, ImageOps

from palpate.adapters.log import TrialLog
from palpate.adapters.mujoco import (
    ACTION,
    FORCE,
    Array,
    DrawnCell,
    Moment,
    Stage,
    View,
    arrow_pixels,
    draw_arrow,
    metres_per_N,
    reference_N,
)
from palpate.adapters.visualisation.video.trajectory import Trajectory
from palpate.core.policy import compass_actions

_INSET: Final = 0.42
"""Width and height of the inset, as a fraction of the picture height."""
_RING: Final = (0, 110, 120)
_CORNERS: Final = 64
"""Number of points on the visible half of the hole's rim. Every other line between them is drawn."""
_STEP_PEGS: Final = 0.4
_SCALE_AT: Final = (0.025, 0.965)
"""Foot of the scale arrow, as fractions of the width and height."""
_STEPS: Final = {action.name: action.displacement_m for action in compass_actions(_STEP_PEGS)}
"""Arrow for each action, in peg diameters, because at true scale the steps would be too small to see."""
_FINE: Final = 2
"""Factor by which arrows and lines are drawn too large and then reduced, to smooth them."""
_LINES: Final = 30
"""Number of text lines that would fill the height of an image."""
_SMALLEST_PX: Final = 7
_INK: Final = (24, 32, 42)
_PAPER: Final = (255, 255, 255, 190)


class Painter:
    """Context manager that paints images of a trial and releases the OpenGL context on exit.

    Raises:
        LogError: The log does not describe the cell completely.
        UsageError: No OpenGL backend works.
    """

    def __init__(self, log: TrialLog, trajectory: Trajectory, size: tuple[int, int], camera: str) -> None:
        self._size, self._camera = size, camera
        self._cell = DrawnCell(log)
        self._cell.pose(trajectory.moments[0])
        self._close, self._arm = self._cell.views()
        self._reference_N = reference_N(dist(m.force_N, (0, 0, 0)) for m in trajectory.moments if m.force_N is not None)
        self._outcome = outcome_of(log)
        self._last = trajectory.moments[-1].tick
        start, part = log.start, "contour" if self._cell.contour else "hole"
        policy = "learned policy" if start.policy == "document" else start.policy
        # The notes say what is drawn from assumptions.
        place = f"where the {start.world} had it" if self._cell.hole_known else "at its nominal position"
        self._notes = [f"{Path(log.path).stem}: {start.arm}, {policy}", f"{part}: {place}"]
        if not trajectory.tared:
            self._notes.append("force: raw, weight included")
        self._to_task: Array = self._cell.goal_in_base.rotation.T
        self._stage = Stage(self._cell, size)

    def paint(self, moment: Moment) -> Image.Image:
        """Return the RGB image at a given time.

        Raises:
            LogError: The joint angles do not match the arm.
        """
        self._cell.pose(moment)
        view = self._arm if self._camera == "arm" else self._close
        picture = Image.fromarray(self._stage.picture(view, *self._size))
        force = self._cell.force_in_base(moment)
        self._draw_signs(picture, view, moment, force)
        if self._camera == "both":
            self._add_inset(picture)
        self._write(picture, moment, force)
        return picture

    def _draw_signs(self, picture: Image.Image, view: View, moment: Moment, force: Array | None) -> None:
        size = (self._size[0] * _FINE, self._size[1] * _FINE)
        sheet = Image.new("RGBA", size, (255, 255, 255, 0))
        draw = ImageDraw.Draw(sheet)
        if view.cut:
            # Towards the camera, where the plate is cut away.
            rim = [] if self._cell.contour else [view.pixel_of(point, *size) for point in self._cell.rim_m(_CORNERS)]
            for dash in zip(rim[::2], rim[1::2], strict=True):
                draw.line(dash, fill=_RING, width=max(size[1] // 240, 2))
        m_per_N, width = metres_per_N(self._reference_N, view), size[1] / 75
        step = _STEPS.get("" if moment.decision is None else moment.decision.action)
        if step is not None:
            along = self._to_task.T @ np.array([*step, 0.0]) * self._cell.peg_diameter_m
            tip = self._cell.tip_m
            draw_arrow(draw, view.pixel_of(tip, *size), view.pixel_of(tip + along, *size), width, ACTION)
        if force is not None:
            foot, head = arrow_pixels(view, size, self._cell.tip_m, force, m_per_N)
            draw_arrow(draw, foot, head, width, FORCE)
        x, y = size[0] * _SCALE_AT[0], size[1] * _SCALE_AT[1]
        length = m_per_N * self._reference_N * view.pixels_per_m(size[1])
        draw_arrow(draw, (x, y), (x + length, y), width, FORCE)
        sheet = sheet.resize(self._size, Image.Resampling.BOX)
        picture.paste(sheet, mask=sheet)

    def _add_inset(self, picture: Image.Image) -> None:
        width, height = self._size
        side = round(min(_INSET * height, 0.34 * width))
        inset = Image.fromarray(self._stage.picture(self._arm, side, side))
        corner, edge = (width - side - max(height // 60, 2), max(height // 60, 2)), max(height // 240, 1)
        picture.paste(ImageOps.expand(inset, edge, (255, 255, 255)), (corner[0] - edge, corner[1] - edge))

    def _write(self, picture: Image.Image, moment: Moment, force: Array | None) -> None:
        in_task = None if force is None else (self._to_task @ force).tolist()
        write(picture, (0.03, 0.03), now_text(moment, in_task), "la")
        write(picture, (_SCALE_AT[0], _SCALE_AT[1] - 0.03), f"{self._reference_N:g} N on the tool", "ls")
        # The outcome, which appears last, is placed above, so that no other text moves.
        remarks = [self._outcome] if self._outcome and moment.tick == self._last else []
        write(picture, (0.97, 0.97), "\n".join((*remarks, *self._notes)), "rd")

    def __enter__(self) -> Painter:
        return self

    def __exit__(self, *exception: object) -> None:
        self._stage.close()


@cache
def _font(size_px: int) -> ImageFont.FreeTypeFont:
    """Return DejaVu Sans Mono from Matplotlib, which is the same on every computer."""
    from matplotlib import get_data_path

    return ImageFont.truetype(str(Path(get_data_path(), "fonts", "ttf", "DejaVuSansMono.ttf")), size_px)


def now_text(moment: Moment, force_N: Sequence[float] | None) -> str:
    """Return the caption at a given time. ``force_N`` is the force in the task frame, (3,); None if not measured."""
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


def outcome_of(log: TrialLog) -> str:
    """Return the outcome of a trial, or an empty string if the log does not contain it."""
    if log.end is None:
        return ""
    return f"ended: {log.end.error}" if log.end.error else log.outcome


def write(picture: Image.Image, place: tuple[float, float], text: str, anchor: str) -> None:
    """Write lines on a light background. ``place`` is in fractions of width and height; ``anchor`` is Pillow's."""
    width, height = picture.size
    size_px = max(round(min(height, width * 0.75) / _LINES), _SMALLEST_PX)
    corner, pad, draw = (place[0] * width, place[1] * height), size_px * 0.4, ImageDraw.Draw(picture, "RGBA")
    align = "right" if anchor[0] == "r" else "left"
    box = draw.multiline_textbbox(corner, text, _font(size_px), anchor, align=align)
    draw.rounded_rectangle((box[0] - pad, box[1] - pad, box[2] + pad, box[3] + pad), pad, fill=_PAPER)
    draw.multiline_text(corner, text, _INK, _font(size_px), anchor, align=align)
