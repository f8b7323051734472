"""Trial phases: classes with one method to enter the phase and one to run a tick of it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
