"""Surveying holes: a probe finds where holes are, how wide and how deep, by touch, so that they can be taught."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
