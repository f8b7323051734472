"""The phases of a trial: classes with a method to enter the phase and a step for each tick until it is over."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
