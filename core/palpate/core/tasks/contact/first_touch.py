"""The stiffness with which the plate was first met, from the samples of the touch itself."""

from collections import deque
from typing import Final

from palpate.core.ports import Snapshot

_SAMPLES: Final = 64
_LEAST_SHARE: Final = 0.15
"""The touch begins after the last force below this share of the pressing force."""
_LEAST_WAY_SHARE: Final = 0.25
"""A touch that went less deep, as a share of the spring's way under the pressing force, determines no stiffness."""
_FEWEST: Final = 8


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
        touched: list[tuple[float, float]] = []
        for time_ns, force_N in self._forces:
            if force_N > -_LEAST_SHARE * self._press_N:
                touched.clear()
            elif (depth_m := self._depth_at(time_ns)) is not None:
                touched.append((depth_m, force_N))
        if len(touched) < _FEWEST:
            return None
        depths = [depth for depth, _ in touched]
        if max(depths) - min(depths) < _LEAST_WAY_SHARE * self._press_N / self._stiffness:
            return None
        mean_m = sum(depths) / len(depths)
        square = sum((depth - mean_m) ** 2 for depth in depths)
        product = sum((depth - mean_m) * force for depth, force in touched)
        return -product / square / self._stiffness

    def _depth_at(self, time_ns: int) -> float | None:
        before: tuple[int, float] | None = None
        for then_ns, depth_m in self._depths:
            if then_ns >= time_ns:
                if before is None:
                    return depth_m if then_ns == time_ns else None
                return before[1] + (depth_m - before[1]) * (time_ns - before[0]) / (then_ns - before[0])
            before = (then_ns, depth_m)
        return None
