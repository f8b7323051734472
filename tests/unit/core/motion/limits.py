"""Joint limits, as tests look at them."""

import numpy as np
import numpy.typing as npt

from palpate.core.motion.model import Kinematics


def within_limits(kinematics: Kinematics, q_rad: npt.ArrayLike) -> bool:
    """Whether every joint is inside its position limits, the limits included."""
    q = np.asarray(q_rad)
    return bool(np.all(q >= kinematics.lower_rad) and np.all(q <= kinematics.upper_rad))
