"""All settings for runs, rigs and real-time operation, and their conversion to and from TOML."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
