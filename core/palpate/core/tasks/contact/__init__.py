"""Contact verification for all tasks, which checks that the measured force is real."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
