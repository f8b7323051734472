"""The phases of a trial: classes with a method that enters the phase and one that runs a tick of it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
