"""What the operating system can do for a loop that must not be late; see :class:`RealTime`."""

from palpate.adapters.realtime.config import RealTimeConfig
from palpate.adapters.realtime.grants import Grant
from palpate.adapters.realtime.kernel import Kernel
from palpate.adapters.realtime.real_time import RealTime, join_loop, request, take_real_time

__all__ = ["Grant", "Kernel", "RealTime", "RealTimeConfig", "join_loop", "request", "take_real_time"]
