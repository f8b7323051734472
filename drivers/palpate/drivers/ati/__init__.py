"""Driver for ATI's Net F/T: a force/torque sensor that streams its records over UDP (RDT), its settings over HTTP.

FACT: read in ATI's manual 9620-05-Net FT, or seen in what a box or a public client sends. Nothing here has met real
hardware.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
