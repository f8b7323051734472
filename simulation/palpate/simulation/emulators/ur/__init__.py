"""Emulation of a Universal Robots controller: RTDE (30004), dashboard (29999) and scripts (30003).

Sources are Universal Robots' RTDE guide and dashboard manual, and the messages of the ur_rtde 1.6.5 client. No code is
shared with a client. Scripts are not interpreted: each is treated as the control script of ur_rtde.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
