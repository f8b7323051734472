"""The measurement vector of the task: what the feature extractors are given once per decision.

========  =====  ==========================================================================
channel   unit   meaning
========  =====  ==========================================================================
x, y, z   m      position of the tool tip relative to the nominal goal
fx fy fz  N      force that the environment exerts on the tool, filtered
tx ty tz  N m    torque of the same wrench about the tool tip, filtered
========  =====  ==========================================================================

All of it in the task frame: right-handed, with its origin at the nominal goal.
"""

from __future__ import annotations

from typing import Final

CHANNELS: Final = ("x", "y", "z", "fx", "fy", "fz", "tx", "ty", "tz")
"""Names of the nine components, in the order of the vector."""
