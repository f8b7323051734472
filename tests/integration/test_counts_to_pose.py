"""From joint angles through encoder counts and back to the tip: counts cost less than 0.05 mm."""

import numpy as np

from palpate.core.motion import Kinematics, arm_named
from palpate.drivers.zebra_zero.codec import Transmission
from tests.support.tool import TOOL

POSES = 2000


def test_the_tip_is_where_the_counts_say():
    kinematics = Kinematics(arm_named("zebra-zero"), TOOL)
    transmission = Transmission()
    rng = np.random.default_rng(0)
    worst_m = 0.0
    for _ in range(POSES):
        q = rng.uniform(kinematics.lower_rad, kinematics.upper_rad)
        kinematics.update(q)
        tip = kinematics.tip_position_m.copy()
        kinematics.update(np.array(transmission.to_rad(transmission.to_counts(q))))
        worst_m = max(worst_m, float(np.linalg.norm(kinematics.tip_position_m - tip)))
    assert 0.0 < worst_m < 5e-5
