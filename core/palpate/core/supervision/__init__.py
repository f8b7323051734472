"""The contact supervisor: watches every tick, clamps or trips, and lets no trial begin before a person acknowledges."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
