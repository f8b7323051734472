"""Driver for a JR3 force/torque sensor behind the public Mbed board firmware, over CAN.

Statements about the device carry a mark: FACT is read in the source that is named, CALC is arithmetic on facts,
INFERENCE is our reading, and "assumed" has no source at all. Nothing here has met real hardware.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
