"""The arm in a process of its own, which owns its wire and brings it to rest when the loop falls silent.

The loop's side is :class:`HostedArm`, one object for encoders and servos; any adapter can be hosted. Set-points and
requests go over a socket, what the joints and the latch are comes back through shared memory that has no name, so
neither side ever waits for a bus, and nothing is left behind whichever side is killed.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
