"""ATI's Net F/T as its box behaves: the RDT stream over UDP and the page with its settings over HTTP."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
