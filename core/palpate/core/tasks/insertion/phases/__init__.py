"""The phases of a trial. Each is a class with an entry method, a step for each tick, and an end."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
