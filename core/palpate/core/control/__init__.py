"""Motion laws: one per kind of action; each turns forces and positions into a tip velocity."""

from palpate.core.control.damping import DampingControl
from palpate.core.control.force import ForceControl
from palpate.core.control.hybrid import HybridControl
from palpate.core.control.law import ControlLaw
from palpate.core.control.position import PositionControl

__all__ = ["ControlLaw", "DampingControl", "ForceControl", "HybridControl", "PositionControl"]
