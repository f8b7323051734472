"""Driver for a JR3 force/torque sensor on CAN, on a board with the public Mbed firmware.

Statements about the device are marked: FACT is taken from the named source, CALC is calculated from facts, INFERENCE is
our interpretation, and "assumed" has no source. Not tested on real hardware.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
