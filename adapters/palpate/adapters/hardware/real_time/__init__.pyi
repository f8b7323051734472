from .scheduling import RealTime as RealTime
from .scheduling import RealTimeResult as RealTimeResult
from .scheduling import join_loop as join_loop
from .scheduling import take_real_time as take_real_time
from .session import LoopTimer as LoopTimer
from .session import RealTimeSession as RealTimeSession
