"""Do joint angles follow the set-points as they did? A fit of the last half second says how late, and how far.

A controller, or whatever stands before it, may give angles of before under new times: each looks right, and none is as
far from its set-point as a watch of positions allows.
"""

from collections import deque
from typing import Final

import numpy as np

from palpate.core.ports import JointVector

LATER_NS: Final = 40_000_000
"""By so much later than before angles may follow, where the rig file's ``patience`` is 1."""
_STEP_NS: Final = 10_000_000
_WINDOW: Final = 50
"""Steps of what is fitted."""
_MOST_LAG: Final = 16
_PERIOD_NS: Final = 100_000_000
"""How often it is fitted."""
_MOVED_RAD, _FAR_RAD, _NOISE_RAD = 0.5e-3, 0.5e-3, 0.05e-3
"""Root mean squares: of set-points that tell a delay, of those that tell how far, and of what encoders may add."""
_SHARPEST: Final = 4
"""Where delays farther apart than this fit equally well, nothing is told: a steady motion has no delay."""
_GAP_NS: Final = 60_000_000
"""Where a bus or this computer was away for so long nothing is told either: what happened meanwhile is not known."""
_IN_A_ROW, _KNOWN, _KEPT = 3, 3, 15
_LEAST_SHARE, _MOST_SHARE = 0.65, 1.5
_CLEAR: Final = 2.0
"""So much more than what no share explains, as a motion that other joints stir up."""


class Following:
    """Set-points and angles of one stretch.

    Args:
        more_ns: So much later than usual angles may follow.
    """

    def __init__(self, more_ns: int) -> None:
        self._more = more_ns / _STEP_NS
        self._sent: deque[tuple[int, JointVector]] = deque(maxlen=512)
        self._found: deque[tuple[int, JointVector]] = deque(maxlen=512)
        self._usual: deque[float] = deque(maxlen=_KEPT)
        self._due_ns = self._late = 0
        self._astray = np.zeros(1, dtype=int)

    def note(self, sent_ns: int, setpoint_rad: JointVector, found_ns: int, position_rad: JointVector) -> str | None:
        """What is wrong with how angles follow; None while nothing is, or nothing can be told.

        Args:
            sent_ns: When the set-point went out.
            found_ns: When the angles were measured, by their own word.
        """
        self._sent.append((sent_ns, setpoint_rad))
        if not self._found or found_ns > self._found[-1][0]:
            self._found.append((found_ns, position_rad))
        if sent_ns < self._due_ns:
            return None
        self._due_ns = sent_ns + _PERIOD_NS
        return self._fitted()

    def _fitted(self) -> str | None:
        end_ns = self._found[-1][0]
        begin_ns = end_ns - _WINDOW * _STEP_NS
        if self._found[0][0] > begin_ns or self._sent[0][0] > begin_ns - _MOST_LAG * _STEP_NS:
            return None
        angles = _at(self._found, end_ns, _WINDOW)
        setpoints = _at(self._sent, end_ns, _WINDOW + _MOST_LAG)
        if angles is None or setpoints is None:
            return None
        angles -= angles.mean(axis=0)
        lags = range(_MOST_LAG + 1)
        earlier = np.stack([setpoints[_MOST_LAG - lag : _MOST_LAG - lag + _WINDOW + 1] for lag in lags])
        earlier -= earlier.mean(axis=1, keepdims=True)
        moved = (earlier**2).sum(axis=1)
        if np.sqrt(moved.sum(axis=1).min() / _WINDOW) < _MOVED_RAD:
            return None
        # Each joint by a share of its own: one that stands still, or has another scale, is as late as the others.
        shares = (earlier * angles).sum(axis=1) / np.maximum(moved, 1e-12)
        misfit = np.sqrt(np.maximum((angles**2).sum() - (shares**2 * moved).sum(axis=1), 0.0) / _WINDOW)
        best = int(misfit.argmin())
        fit = np.flatnonzero(misfit <= 1.3 * misfit[best] + _NOISE_RAD)
        if fit[-1] - fit[0] > _SHARPEST:
            return None
        share, far = shares[best], np.sqrt(moved[best] / _WINDOW)
        rest = np.sqrt(np.maximum((angles**2).sum(axis=0) / _WINDOW - (share * far) ** 2, 0.0))
        is_wrong = ((share < _LEAST_SHARE) | (share > _MOST_SHARE)) & (abs(share - 1.0) * far >= _CLEAR * rest)
        # Where a joint moves too little it tells nothing, neither that it is wrong nor that it is right.
        self._astray = np.where(far < _FAR_RAD, self._astray, (self._astray + 1) * is_wrong)
        return self._judged(best, share)

    def _judged(self, lag: int, shares: np.ndarray) -> str | None:
        usual = float(np.median(self._usual)) if len(self._usual) >= _KNOWN else None
        self._late = self._late + 1 if usual is not None and lag - usual >= self._more else 0
        self._usual.append(lag)
        if self._astray.max() >= _IN_A_ROW:
            joint = int(self._astray.argmax())
            return f"joint {joint + 1} moves {shares[joint]:.2f} times as far as its set-points"
        if self._late >= _IN_A_ROW and usual is not None:
            ms = _STEP_NS // 1_000_000
            return f"its angles follow the set-points {lag * ms} ms later, {usual * ms:.0f} ms before"
        return None


def _at(samples: deque[tuple[int, JointVector]], end_ns: int, steps: int) -> np.ndarray | None:
    """Angles at even times until then, (steps + 1, n); None where a gap is between."""
    times = np.array([time_ns - end_ns for time_ns, _ in samples], dtype=float)
    even = np.arange(-steps, 1) * float(_STEP_NS)
    within = np.append(times[times > even[0]], 0.0)
    if np.diff(within, prepend=even[0]).max() > _GAP_NS:
        return None
    columns = zip(*(angles for _, angles in samples), strict=True)
    return np.stack([np.interp(even, times, column) for column in columns], axis=1)
