"""A belief over the place of the hole: a touch model learned from hindsight, and a planner on it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
