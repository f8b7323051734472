"""The phases of a trial, one class for each, with entry, one tick, and end."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
