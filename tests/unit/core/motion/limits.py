"""Joint limits, as tests look at them."""

import numpy as np


def within_limits(kinematics, q_rad):
    """Whether every joint is inside its position limits, the limits included."""
    q = np.asarray(q_rad)
    return bool(np.all(q >= kinematics.lower_rad) and np.all(q <= kinematics.upper_rad))
