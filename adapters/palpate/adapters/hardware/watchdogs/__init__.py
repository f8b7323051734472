"""Watchdogs: decorators and threads that bring the arm to rest when something has gone quiet, or a person says so.

They stop; they never start again by themselves. What trips is told as a :class:`WatchdogTrip`, and where it latches, a
person's ``acknowledge()`` leads out of it. None of them takes a lock on the way to ``arm.stop()``, so that every stop
may come from a signal handler.

They read the clock from other threads and from signal handlers.
"""

from palpate.adapters.hardware.watchdogs.arm import GuardedArm, WatchedArm
from palpate.adapters.hardware.watchdogs.operator_stop import OperatorSources, OperatorStop
from palpate.adapters.hardware.watchdogs.process import ProcessWatchdog, WatchedClock
from palpate.adapters.hardware.watchdogs.sensors import WatchedForceSensor, WatchedJointEncoder
from palpate.adapters.hardware.watchdogs.trip import Latching, WatchdogTrip

__all__ = [
    "GuardedArm",
    "Latching",
    "OperatorSources",
    "OperatorStop",
    "ProcessWatchdog",
    "WatchdogTrip",
    "WatchedArm",
    "WatchedClock",
    "WatchedForceSensor",
    "WatchedJointEncoder",
]
