"""Compass steps by single keys: of a terminal, without Enter, or of a pipe."""

import os
import select
import termios
import tty
from contextlib import suppress
from typing import Any, Final, Self

from typing_extensions import override

from palpate.adapters.experiments.teaching.hand import Hand
from palpate.core.policy import COMPASS_NAMES, Observation

_UP, _DOWN, _RIGHT, _LEFT = "+x", "-x", "+y", "-y"
# Behind the arm's base, looking along x at the plate: +x is away from the arm, +y to the right.
_STEPS: Final = {
    "w": _UP, "x": _DOWN, "d": _RIGHT, "a": _LEFT, "e": "+x+y", "q": "+x-y", "c": "-x+y", "z": "-x-y", "y": "-x-y",
    "8": _UP, "2": _DOWN, "6": _RIGHT, "4": _LEFT, "9": "+x+y", "7": "+x-y", "3": "-x+y", "1": "-x-y",
    "[A": _UP, "[B": _DOWN, "[C": _RIGHT, "[D": _LEFT, "OA": _UP, "OB": _DOWN, "OC": _RIGHT, "OD": _LEFT,
}  # fmt: skip
_REST: Final = (" ", "s", "5")
_ESCAPE, _END_OF_FILE = "\x1b", "\x04"
_POLL_S: Final = 0.2
_SEQUENCE_S: Final = 0.05
"""How long the rest of an arrow key's three characters may take, which tells it from the key Escape."""
KEYS_HELP: Final = (
    "arrows, or q w e / a d / z x c, or the number pad: a step, up is +x, right is +y; space: rest; Escape: end"
)


class Keys(Hand):
    """Waits at each step until a key is pressed: for the simulator, whose time waits, too.

    Args:
        fd: A terminal, or anything else that characters come from; its end ends the lesson.
    """

    def __init__(self, fd: int) -> None:
        self._fd, self._typed = fd, ""
        self._before: list[Any] | None = None

    @override
    def __enter__(self) -> Self:
        if os.isatty(self._fd):
            self._before = termios.tcgetattr(self._fd)
            tty.setcbreak(self._fd, termios.TCSANOW)
        return self

    @override
    def __exit__(self, *_: object) -> None:
        if self._before is not None:
            with suppress(termios.error):
                # A terminal that is gone needs no restoring.
                termios.tcsetattr(self._fd, termios.TCSANOW, self._before)

    @override
    def wait(self) -> None:
        # Whoever presses a key for a step is ready.
        return

    @property
    @override
    def held(self) -> bool:
        return True

    @override
    def step(self, observation: Observation) -> int | None:
        while not self._ended:
            key = self._next()
            if key in (_ESCAPE, _END_OF_FILE):
                self.end()
            elif key in _STEPS:
                return COMPASS_NAMES.index(_STEPS[key])
            elif key in _REST:
                return None
        return None

    def _next(self) -> str:
        """The next key: a character, or what follows Escape of an arrow; empty for none yet."""
        if not self._typed and not self._read(_POLL_S):
            return ""
        key, self._typed = self._typed[0].lower(), self._typed[1:]
        if key != _ESCAPE:
            return key
        while len(self._typed) < 2 and self._read(_SEQUENCE_S):
            pass
        arrow = self._typed[:2]
        if arrow not in _STEPS:
            return _ESCAPE
        self._typed = self._typed[2:]
        return arrow

    def _read(self, timeout_s: float) -> bool:
        """Take what was typed meanwhile; False where nothing was."""
        if self._typed.endswith(_END_OF_FILE) or not select.select([self._fd], [], [], timeout_s)[0]:
            return False
        try:
            typed = os.read(self._fd, 64)
        except OSError:
            # The other end of a terminal is gone.
            typed = b""
        self._typed += typed.decode("latin-1") or _END_OF_FILE
        return True
