"""Tables as plain text, with aligned columns or as CSV."""

import csv
import io
from collections.abc import Collection, Iterable, Sequence
from typing import Any


def aligned(rows: Sequence[Sequence[str]], left: int | Collection[int] | None = None) -> str:
    """Format one line per row. ``left`` is the number of left-aligned columns, or their indices; None for all."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    words = len(widths) if left is None else left
    words = range(words) if isinstance(words, int) else words

    def line(row: Sequence[str]) -> str:
        cells = zip(row, widths, strict=True)
        return "  ".join(cell.ljust(w) if i in words else cell.rjust(w) for i, (cell, w) in enumerate(cells)).rstrip()

    return "".join(f"{line(row)}\n" for row in rows)


def counted(count: int, noun: str) -> str:
    """Return a number with its noun, in the plural unless the number is 1."""
    return f"{count} {noun}{'s' * (count != 1)}"


def csv_text(rows: Iterable[Iterable[Any]]) -> str:
    """Format rows as CSV with LF line endings, starting with the header."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
