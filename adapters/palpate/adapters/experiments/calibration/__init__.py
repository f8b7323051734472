"""Commissioning: what a new rig's owner has to find out, by moving slowly and touching."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
