"""Touches as a round peg gives them: a torque across the heading of the hole, an offset and noise."""

import numpy as np

from palpate.core.policy.belief.touches import LENGTH_M, TORQUE_NM, Touch, TouchedTrial

CUE_NM = 0.02
OFFSET_NM = (0.004, -0.002)


def touch_at(place_m: np.ndarray, hole_m: np.ndarray, rng: np.random.Generator, noise_Nm: float = 0.003) -> Touch:
    x, y = (hole_m - place_m) / max(float(np.hypot(*(hole_m - place_m))), 1e-9)
    torque = np.array([CUE_NM * y, -CUE_NM * x]) + OFFSET_NM + noise_Nm * rng.standard_normal(2)
    a, b = np.rint(place_m / LENGTH_M).astype(int).tolist()
    c, d = np.rint(torque / TORQUE_NM).astype(int).tolist()
    return Touch((a, b), (c, d), 4900)


def trials(count: int, touches: int = 8, seed: int = 3, noise_Nm: float = 0.003) -> list[TouchedTrial]:
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(count):
        hole = rng.uniform(-0.003, 0.003, 2)
        felt = tuple(touch_at(rng.uniform(-0.0035, 0.0035, 2), hole, rng, noise_Nm) for _ in range(touches))
        x, y = np.rint(hole / LENGTH_M).astype(int).tolist()
        made.append(TouchedTrial((x, y), felt))
    return made
