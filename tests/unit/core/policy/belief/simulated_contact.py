"""Touches as a round peg gives them: a torque across the heading of the hole, an offset and noise."""

import numpy as np

from palpate.core.policy.belief.contacts import LENGTH_M, TORQUE_NM, ContactObservation, ContactTrial

CUE_NM = 0.02
OFFSET_NM = (0.004, -0.002)


def touch_at(place_m, hole_m, rng, noise_Nm=0.003):
    x, y = (hole_m - place_m) / max(float(np.hypot(*(hole_m - place_m))), 1e-9)
    torque = np.array([CUE_NM * y, -CUE_NM * x]) + OFFSET_NM + noise_Nm * rng.standard_normal(2)
    return touch_of(place_m, torque)


def touch_of(place_m, torque_Nm):
    a, b = np.rint(place_m / LENGTH_M).astype(int).tolist()
    c, d = np.rint(torque_Nm / TORQUE_NM).astype(int).tolist()
    return ContactObservation((a, b), (c, d), 4900)


def trials(count, contacts=8, seed=3, noise_Nm=0.003):
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(count):
        hole = rng.uniform(-0.003, 0.003, 2)
        felt = tuple(touch_at(rng.uniform(-0.0035, 0.0035, 2), hole, rng, noise_Nm) for _ in range(contacts))
        x, y = np.rint(hole / LENGTH_M).astype(int).tolist()
        made.append(ContactTrial((x, y), felt))
    return made


GAINS = (1.2, -0.3)
"""Along and across the heading of the hole, how much more of a lean's torque there is."""


def expected_Nm(way_m, lean_Nm):
    """Torque of a tool that leans."""
    along = way_m / float(np.hypot(*way_m))
    across = np.array([-along[1], along[0]])
    seen = sum((1.0 + g) * (lean_Nm @ axis) * axis for g, axis in zip(GAINS, (along, across), strict=True))
    return seen - CUE_NM * across


def leaning_trials(leans_Nm, contacts=12, seed=5):
    """Trials with a lean each."""
    rng, made = np.random.default_rng(seed), []
    for tilt in leans_Nm:
        felt = []
        for _ in range(contacts):
            place = rng.uniform(-0.0025, 0.0025, 2)
            torque = expected_Nm(-place, np.array(tilt)) + 0.003 * rng.standard_normal(2)
            felt.append(touch_of(place, torque))
        made.append(ContactTrial((0, 0), tuple(felt)))
    return made
