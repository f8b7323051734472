"""Arms of our own drivers, by the name of their adapter."""

from palpate.adapters.hardware.plugins import arm_maker
from palpate.adapters.hardware.served_arm import DriverArm


def driver_arm(name, settings, context):
    """The arm, not open."""
    made = arm_maker(name)(settings, context)
    assert isinstance(made, DriverArm)
    return made
