"""Motors for the emulated drives: either those in the simulated cell or ideal ones."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
