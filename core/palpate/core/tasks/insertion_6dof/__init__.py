"""Insertion in six degrees of freedom, with a tool that turns, tilts and complies, for pegs with corners."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
