from .device import UrArm as UrArm
from .link import UrHello as UrHello
from .link import UrLink as UrLink
from .link import UrState as UrState
from .settings import UrSettings as UrSettings
from .tool_force import RANGE_N as RANGE_N
from .tool_force import RANGE_NM as RANGE_NM
from .tool_force import UrToolForce as UrToolForce
