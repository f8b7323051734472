"""Figure files. Identical figures give identical bytes. Matplotlib is imported only when a figure is drawn."""

import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, Literal

from palpate.core.errors import ConfigurationError

_NOTHING: Final = {
    "svg": {"Date": None, "Creator": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
"""Metadata without the date and the version."""


def figure_kind(path: Path, setting: str) -> str:
    """Return a figure's format according to its file name: png, svg or pdf.

    Raises:
        ConfigurationError: The suffix is not supported; ``setting`` names the setting.
    """
    kind = path.suffix.lower().removeprefix(".")
    if kind not in _NOTHING:
        raise ConfigurationError(setting, str(path), "a file name that ends in .png, .svg or .pdf")
    return kind


class Canvas:
    """A figure being drawn."""

    def __init__(self, figure: Any) -> None:
        self.figure, self.content = figure, b""


@contextmanager
def drawing(
    width_in: float,
    height_in: float,
    dpi: int,
    kind: str = "png",
    settings: Mapping[str, Any] | None = None,
    layout: Literal["constrained"] | None = "constrained",
) -> Iterator[Canvas]:
    """Yield an empty canvas, and set its ``content`` after the block. A user's matplotlibrc has no effect."""
    from matplotlib import style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with style.context(["default", {"svg.hashsalt": "palpate", **(settings or {})}]):
        canvas = Canvas(Figure(figsize=(width_in, height_in), dpi=dpi, layout=layout))
        FigureCanvasAgg(canvas.figure)
        yield canvas
        buffer = io.BytesIO()
        canvas.figure.savefig(buffer, format=kind, metadata=_NOTHING[kind])
        canvas.content = buffer.getvalue()
