"""Models of hidden states, learned from trials of actions and symbols, tracked as a belief and planned on."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
