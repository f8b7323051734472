"""Following a surface: a tool slides along a contour that nobody knows, and presses on it with an even force."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
