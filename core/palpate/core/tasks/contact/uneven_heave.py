"""A heave whose strokes are uneven: a sensor that repeats what it once felt does not follow it."""

from typing import Final

import numpy as np

from palpate.core.ports import PERIOD_S

_STROKES: Final = (2, 3, 4)
_HEAVE_M: Final = 3e-4


class UnevenHeave:
    """Strokes up and down, each as long as is drawn.

    Args:
        speed_m_s: Of each.
        strokes: Their lengths in ticks, of which one is drawn for each.
        heave_m: No further from where it began.
    """

    def __init__(self, speed_m_s: float, strokes: tuple[int, ...] = _STROKES, heave_m: float = _HEAVE_M) -> None:
        self._speed_m_s, self._strokes, self._heave_m = speed_m_s, strokes, heave_m

    def begin_trial(self, rng: np.random.Generator) -> None:
        """A trial begins, whose strokes are drawn from this."""
        self._rng = rng

    def begin(self) -> None:
        """The heave begins here, upwards."""
        self._left, self._velocity_m_s, self._heaved_m = 0, self._speed_m_s, 0.0

    def velocity_m_s(self) -> float:
        """Velocity along the tool axis for this tick."""
        if not self._left:
            self._velocity_m_s = -self._velocity_m_s
            tick_m = self._velocity_m_s * PERIOD_S
            fits = [ticks for ticks in self._strokes if abs(self._heaved_m + ticks * tick_m) <= self._heave_m]
            fits = fits or [self._strokes[0]]
            self._left = fits[int(self._rng.integers(len(fits)))]
        self._left -= 1
        self._heaved_m += self._velocity_m_s * PERIOD_S
        return self._velocity_m_s
