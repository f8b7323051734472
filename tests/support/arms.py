"""Arms of our own drivers, by the name of their adapter; the arms that tests of physics take."""

import pytest

from palpate.adapters.hardware.plugins import arm_maker
from palpate.adapters.hardware.served_arm import DriverArm
from palpate.core.motion.arm import ARMS

EVERY_ARM = [arm if arm == "zebra-zero" else pytest.param(arm, marks=pytest.mark.nightly) for arm in ARMS]


def driver_arm(name, settings, context):
    """The arm, not open."""
    made = arm_maker(name)(settings, context)
    assert isinstance(made, DriverArm)
    return made
