"""Recorded trials fed back through the unmodified core, and every output held against what was recorded."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
