"""The phases of a trial, one class each: how it is entered, what it does in a tick, and whether it is over."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
