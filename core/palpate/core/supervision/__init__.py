"""The supervisor: it monitors every tick, and clamps or trips; after a trip a person must acknowledge the fault."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
