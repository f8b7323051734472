"""The arms that palpate knows; see :mod:`palpate.core.arms.description`."""

from palpate.core.arms.description import ARMS, ArmDescription, arm_named

__all__ = ["ARMS", "ArmDescription", "arm_named"]
