"""The supervisor, which checks every tick and clamps or trips. A person must acknowledge each trip."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
