"""A Universal Robots controller as its sockets behave: RTDE (30004), dashboard (29999), scripts (30003).

Facts from Universal Robots' RTDE guide and dashboard manual, and from what the client ur_rtde 1.6.5 sends. Nothing here
is shared with a client. A script is not interpreted: whatever arrives is taken for the control script of ur_rtde.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
