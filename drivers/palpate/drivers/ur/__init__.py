"""Driver for arms of Universal Robots over RTDE, through the client library ur_rtde; it is no protocol of ours.

The client waits without end for a controller that falls silent, holds the interpreter while it connects, ends its
process on packages that are none, and connects again unasked. So it has a process, which can be given up.
Nothing here has met a real arm.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
