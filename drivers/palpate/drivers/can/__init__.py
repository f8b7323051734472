"""CAN buses: opening one, frames on it, and the one table of whose identifiers are whose."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
