"""The stiffness with which the plate was first met, from the samples of the touch itself."""

from collections import deque
from collections.abc import Sequence
from math import sqrt
from typing import Final

from palpate.core.ports import Snapshot

_SAMPLES: Final = 64
_LEAST_SHARE: Final = 0.15
"""The touch begins after the last force below this share of the pressing force."""
_LEAST_WAY_SHARE: Final = 0.25
"""A touch that went less deep, as a share of the spring's way under the pressing force, determines no stiffness."""
_FEWEST: Final = 8
_STEPS_SHARE: Final = 0.06
"""Of the way's square sum; with as much the force seems to follow the way by so much less than it does."""
_ALIKE: Final = 4.0
"""So many samples are off by the same step, more or less."""
_COMMANDED_ERROR: Final = 1.0
"""Of a share by the commanded speed: an arm that is pushed back, or speeds up, shows 0.4 to 0.9 of what it is."""


class FirstTouch:
    """Fits force over depth while the tool sinks into its own spring.

    Sensor and encoders are read at times of their own, and an arm on a slow bus shows where it was: each force is held
    against the depth at the time at which the force was measured.
    """

    def __init__(self, stiffness_N_per_m: float, press_N: float) -> None:
        self._stiffness, self._press_N = stiffness_N_per_m, press_N
        self.begin()

    def begin(self) -> None:
        """A trial begins."""
        self._forces: deque[tuple[int, float]] = deque(maxlen=_SAMPLES)
        self._depths: deque[tuple[int, float]] = deque(maxlen=_SAMPLES)

    def watch(self, snapshot: Snapshot, force_z_N: float, depth_m: float) -> None:
        """Take in one tick of the approach.

        Args:
            force_z_N: Tared force along the tool axis, negative while pressing.
        """
        for samples, time_ns, value in (
            (self._forces, snapshot.wrench.source_time_ns, force_z_N),
            (self._depths, snapshot.joints.source_time_ns, depth_m),
        ):
            if not samples or time_ns > samples[-1][0]:
                samples.append((time_ns, value))

    @property
    def share(self) -> float | None:
        """Measured stiffness as a share of the gripper's; None where the samples do not determine it."""
        touched = self._touched()
        return self._share(touched) if self._determines(touched) else None

    def steady_share(self, noise_N: float, speed_m_s: float) -> tuple[float, float] | None:
        """The same of a touch at a steady speed, and its standard error by a noise of the force.

        Encoders that count in steps scatter the way, and a force that is held against it seems to follow less than it
        does. Where they do so much, force and way are each held against the time, which is the instrument of
        instrumental variables (Fuller, Measurement Error Models, 1987, section 1.4). Where they hide it the commanded
        speed stands for the way, and the error is as large as the share.
        """
        touched = self._touched()
        if len(touched) < _FEWEST:
            return None
        depths, forces, times = zip(*touched, strict=True)
        square, time_square, way = _square(depths), _square(times), _product(times, depths)
        if not self._determines(touched) or way <= 0.0:
            return -_product(times, forces) / time_square / speed_m_s / self._stiffness, _COMMANDED_ERROR
        steps = square - way * way / time_square
        if steps <= _STEPS_SHARE * square:
            return self._share(touched), noise_N / sqrt(square) / self._stiffness
        share = -_product(times, forces) / way / self._stiffness
        step_N2 = _ALIKE * (share * self._stiffness) ** 2 * steps / (len(times) - 2)
        return share, sqrt((noise_N * noise_N + step_N2) * time_square) / way / self._stiffness

    def _share(self, touched: list[tuple[float, float, float]]) -> float:
        depths, forces, _ = zip(*touched, strict=True)
        return -_product(depths, forces) / _square(depths) / self._stiffness

    def _touched(self) -> list[tuple[float, float, float]]:
        """Depths, forces and times since it touches, m, N, s."""
        touched: list[tuple[float, float, float]] = []
        for time_ns, force_N in self._forces:
            if force_N > -_LEAST_SHARE * self._press_N:
                touched.clear()
            elif (depth_m := self._depth_at(time_ns)) is not None:
                touched.append((depth_m, force_N, time_ns * 1e-9))
        return touched

    def _determines(self, touched: list[tuple[float, float, float]]) -> bool:
        if len(touched) < _FEWEST:
            return False
        depths = [depth for depth, _, _ in touched]
        return max(depths) - min(depths) >= _LEAST_WAY_SHARE * self._press_N / self._stiffness

    def _depth_at(self, time_ns: int) -> float | None:
        before: tuple[int, float] | None = None
        for then_ns, depth_m in self._depths:
            if then_ns >= time_ns:
                if before is None:
                    return depth_m if then_ns == time_ns else None
                return before[1] + (depth_m - before[1]) * (time_ns - before[0]) / (then_ns - before[0])
            before = (then_ns, depth_m)
        return None


def _square(values: Sequence[float]) -> float:
    """Sum of the squares of what each is away from their mean."""
    mean = sum(values) / len(values)
    return sum((value - mean) ** 2 for value in values)


def _product(values: Sequence[float], others: Sequence[float]) -> float:
    """Sum of the products of what each is away from their mean, and the other."""
    mean = sum(values) / len(values)
    return sum((value - mean) * other for value, other in zip(values, others, strict=True))
