"""Real time: what the system grants, where the time of each tick goes, how late ticks are, and why."""

from palpate.adapters.hardware.real_time.attribution import Attribution, Cause, ThreadAccount, attribute
from palpate.adapters.hardware.real_time.kernel import Kernel
from palpate.adapters.hardware.real_time.lateness import Histograms, LatenessSpread, LateTick, Limits, SlowCore
from palpate.adapters.hardware.real_time.real_time import Grant, RealTime, join_loop, request, take_real_time
from palpate.adapters.hardware.real_time.report import plain, table
from palpate.adapters.hardware.real_time.stopwatch import BUSY, LATE, Stopwatch, TickSection

__all__ = [
    "BUSY",
    "LATE",
    "Attribution",
    "Cause",
    "Grant",
    "Histograms",
    "Kernel",
    "LateTick",
    "LatenessSpread",
    "Limits",
    "RealTime",
    "SlowCore",
    "Stopwatch",
    "ThreadAccount",
    "TickSection",
    "attribute",
    "join_loop",
    "plain",
    "request",
    "table",
    "take_real_time",
]
