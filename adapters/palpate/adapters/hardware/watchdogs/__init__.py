"""Watchdogs: decorators and threads that bring the arm to rest when something has gone quiet, or a person says so.

They stop; they never start again by themselves. What trips is told as a :class:`WatchdogTrip`, and where it latches, a
person's ``acknowledge()`` leads out of it. None of them takes a lock on the way to ``arm.stop()``, so that every stop
may come from a signal handler.

They read the clock from other threads and from signal handlers.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
