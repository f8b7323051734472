"""All settings of runs, rigs and real time, and their TOML form."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
