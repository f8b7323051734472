"""The job: part, tool, place and limits as a person states them, and the settings that follow from them."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
