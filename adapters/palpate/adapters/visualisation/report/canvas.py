"""What all pictures of a report share: size, colours, style."""

import re
from contextlib import AbstractContextManager
from typing import Any, Final

from palpate.adapters.log import Canvas, drawing

# Colours that differ for any colour vision (Okabe and Ito), the light ones last.
COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#aa4499", "#000000", "#e69f00", "#56b4e9", "#999933")
LINES: Final = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)), (0, (8, 2)), (0, (3, 3)))
GREY: Final = "#6b7280"
WIDTH_IN: Final = 6.2
"""Width of a picture. On a telephone it is shrunk to two thirds, and letters of 11 points can still be read."""
_DPI: Final = 150
_LONG_LABEL: Final = 26
"""Longer labels do not fit beside each other."""
_STYLE: Final = {
    "font.size": 11.0,
    "axes.titlesize": 11.5,
    "axes.labelsize": 11.0,
    "legend.fontsize": 10.0,
    "xtick.labelsize": 10.0,
    "ytick.labelsize": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "text.usetex": False,
    "text.parse_math": False,
}


def drawn(height_in: float, width_in: float = WIDTH_IN) -> AbstractContextManager[Canvas]:
    """Gives an empty canvas to draw on; when the block ends its ``content`` is there."""
    return drawing(width_in, height_in, _DPI, settings=_STYLE)


def legend_above(figure: Any, axes: Any) -> None:
    """A legend of one panel above all panels: inside one it would lie on a curve sooner or later."""
    handles, labels = axes.get_legend_handles_labels()
    columns = 2 if max(map(len, labels), default=0) <= _LONG_LABEL else 1
    figure.legend(handles, labels, loc="outside upper left", ncols=columns, frameon=False)


def file_name(text: str) -> str:
    """A text as a part of a file name: small letters, digits, points and hyphens."""
    return re.sub(r"[^a-z0-9.]+", "-", text.lower()).strip("-.")[:60] or "x"
