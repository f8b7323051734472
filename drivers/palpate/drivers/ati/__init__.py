"""Driver for the ATI Net F/T, a force/torque sensor that streams records over UDP (RDT) and serves settings over HTTP.

FACT refers to ATI's manual 9620-05-Net FT, or to messages from a box or a public client. Not tested on real hardware.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
