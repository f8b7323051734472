"""Demonstrations: a person chooses step by step, and what was shown becomes examples for a policy."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
