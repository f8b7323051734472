"""The job: part, tool, place and limits as specified by the user, and the settings derived from them."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
