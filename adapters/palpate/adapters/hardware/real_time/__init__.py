"""Real time: what the system grants, where the time of each tick goes, how late ticks are, and why."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
