"""Does the force come again? What a recording shows is what was shown before, whatever the tool does meanwhile."""

from typing import Final

import numpy as np

from palpate.core.ports import CONTROL_RATE_HZ

_WINDOW: Final = 64
"""Samples that are held against earlier ones. Over 32, strokes that are drawn come to the same now and then."""
_SOONEST, _LATEST = 8, 2 * CONTROL_RATE_HZ
"""Samples from one time to the next; a shorter recording comes again at multiples of its length, too."""
_MORE_THAN_NOISE: Final = 1.4
"""Two noisy samples of one force differ by twice the noise's square, which was measured with few; by so much more at
most."""
_SHOWN: Final = 1.6
"""What comes again has to be so many times what differs, or it is nothing but a force at rest."""


class Recurrence:
    """Holds the newest forces against those of before, at any distance.

    The heave of a tool is drawn anew all the time, so what a sound sensor shows of it does not come again: in trials
    without a fault, of 6700 answered looks, it seemed to once. In trials that recordings of 0.1 and 1 s had misled it
    did in nearly all looks, half a second after the recording had come round.
    """

    def begin_trial(self) -> None:
        """A trial begins, with other samples."""
        # Newest first; nothing comes again of what was not there.
        self._forces_N = np.full(_LATEST, np.inf)
        # By sample and distance; the oldest row is overwritten.
        self._squares_N2 = np.full((_WINDOW, _LATEST - _SOONEST), np.inf)
        self._row = 0

    def felt(self, force_N: float) -> None:
        """A new sample of the force along the tool axis."""
        forces_N, squares_N2 = self._forces_N, self._squares_N2[self._row]
        forces_N[1:] = forces_N[:-1]
        forces_N[0] = force_N
        np.subtract(forces_N[_SOONEST:], force_N, out=squares_N2)
        np.square(squares_N2, out=squares_N2)
        self._row = (self._row + 1) % _WINDOW

    def comes_again(self, noise_N: float) -> bool:
        """Whether the newest force is, but for noise, what it was at some time before, and shows more than that noise.

        Args:
            noise_N: Standard deviation of the sensor at rest.
        """
        differs_N2 = float(self._squares_N2.sum(axis=0).min())
        if differs_N2 > _MORE_THAN_NOISE * 2.0 * noise_N * noise_N * _WINDOW:
            return False
        newest_N = self._forces_N[:_WINDOW]
        return float(np.square(newest_N - newest_N.mean()).sum()) > _SHOWN * differs_N2
