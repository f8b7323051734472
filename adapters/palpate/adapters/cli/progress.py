"""How far a command is: a bar on a terminal, a plain line at every tenth of the way elsewhere."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from tqdm import tqdm

_PARTS = 10


class _Lines:
    """The same as a bar, for a file or a pipe: carriage returns would fill it."""

    def __init__(self, total: int, unit: str, label: str, initial: int) -> None:
        self._total, self._unit, self._label = total, unit, f"{label}: " if label else ""
        self.n, self._also = initial, ""

    def update(self, more: int = 1) -> None:
        """Report n more as done."""
        before, self.n = self.n, self.n + more
        if self.n * _PARTS // max(self._total, 1) > before * _PARTS // max(self._total, 1):
            self.write(f"{self._label}{self.n} of {self._total} {self._unit}s{self._also}", sys.stderr)

    def set_postfix_str(self, text: str) -> None:
        """What else the next line holds."""
        self._also = f", {text}"

    def write(self, text: str, file: Any) -> None:
        """A line between the others."""
        file.write(f"{text}\n")
        file.flush()


@contextmanager
def progress(total: int, unit: str, label: str = "", *, initial: int = 0, passing: bool = False) -> Iterator[Any]:
    """Iterate, and print what is reported of each step by ``update``; on the error stream."""
    if passing or sys.stderr.isatty():
        shown = tqdm(
            total=total, initial=initial, unit=unit, desc=label or None, file=sys.stderr, dynamic_ncols=True,
            leave=not passing, disable=None,
        )  # fmt: skip
        with shown as bar:
            yield bar
    else:
        yield _Lines(total, unit, label, initial)
