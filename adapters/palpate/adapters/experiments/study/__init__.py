"""Studies: many runs over settings, policies and seeds, each run once, by any number of workers."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
