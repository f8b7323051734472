"""Driver for an arm with CiA 402 servo drives on a CAN bus, as in a modern refit of the work cell's arm.

There is no evidence that any Zebra Zero ever used CANopen; its only public drivers use a different protocol on a serial
line. This package is intended for a refit of such an arm, or for other arms with CiA 402 drives.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
