"""Hidden-state models, learned from trials' actions and symbols, with belief tracking and planning."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
