"""Emulation of ATI's Net F/T box: the RDT stream over UDP and the settings page over HTTP."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
