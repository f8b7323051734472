"""Arms of our own drivers, by the name of their adapter."""

from collections.abc import Mapping
from typing import Any

from palpate.adapters.hardware.plugins import RigContext, arm_maker
from palpate.adapters.hardware.served_arm import DriverArm


def driver_arm(name: str, settings: Mapping[str, Any], context: RigContext) -> DriverArm:
    """The arm, not open."""
    made = arm_maker(name)(settings, context)
    assert isinstance(made, DriverArm)
    return made
