from .device import UrArm as UrArm
from .link import UrHello as UrHello
from .link import UrLink as UrLink
from .link import UrState as UrState
from .sensor import RANGE_N as RANGE_N
from .sensor import RANGE_NM as RANGE_NM
from .sensor import UrToolForce as UrToolForce
from .settings import UrSettings as UrSettings
