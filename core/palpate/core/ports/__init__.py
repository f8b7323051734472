"""The four ports, the values that pass through them, the device life cycle, and the rig that bundles the ports."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
