"""Progress display for a command: a bar on a terminal; otherwise, one line per tenth of the work."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from typing import Any

from tqdm import tqdm

_PARTS = 10


class _Lines:
    """Progress display for a file or a pipe, which carriage returns would clutter."""

    def __init__(self, total: int, unit: str, label: str, initial: int) -> None:
        self._total, self._unit, self._label = total, unit, f"{label}: " if label else ""
        self.n, self._also, self._first, self._begun_s = initial, "", initial, monotonic()

    def update(self, more: int = 1) -> None:
        """Report n more completed steps."""
        before, self.n = self.n, self.n + more
        if self.n * _PARTS // max(self._total, 1) > before * _PARTS // max(self._total, 1):
            left_s = (monotonic() - self._begun_s) * (self._total - self.n) / (self.n - self._first)
            left = f", about {left_s / 60.0:.0f} min left" if left_s > 60.0 else ""
            self.write(f"{self._label}{self.n} of {self._total} {self._unit}s{self._also}{left}", sys.stderr)

    def set_postfix_str(self, text: str) -> None:
        """Set additional text for the next line."""
        self._also = f", {text}"

    def write(self, text: str, file: Any) -> None:
        """Print a separate line."""
        file.write(f"{text}\n")
        file.flush()


@contextmanager
def progress(total: int, unit: str, label: str = "", *, initial: int = 0, passing: bool = False) -> Iterator[Any]:
    """Yield an object whose ``update`` prints progress to standard error."""
    if passing or sys.stderr.isatty():
        shown = tqdm(
            total=total, initial=initial, unit=unit, desc=label or None, file=sys.stderr, dynamic_ncols=True,
            leave=not passing, disable=None,
        )  # fmt: skip
        with shown as bar:
            yield bar
    else:
        yield _Lines(total, unit, label, initial)
