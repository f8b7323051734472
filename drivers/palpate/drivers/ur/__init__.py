"""Driver for Universal Robots arms over RTDE, based on the client library ur_rtde.

The client waits indefinitely for a silent controller, blocks the interpreter while it connects, ends its process on
invalid packages, and reconnects unprompted. Therefore it runs in a separate process, which can be terminated.
Not tested on a real arm.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
