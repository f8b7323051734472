"""What the operating system can do for a loop that must not be late; see :class:`RealTime`."""

from palpate.adapters.realtime.config import RealTimeConfig
from palpate.adapters.realtime.grants import Grant
from palpate.adapters.realtime.kernel import Kernel
from palpate.adapters.realtime.real_time import RealTime, request, take_real_time

__all__ = ["Grant", "Kernel", "RealTime", "RealTimeConfig", "request", "take_real_time"]
