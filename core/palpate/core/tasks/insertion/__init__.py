"""The insertion task: its phases, the agent that explores, and the laws that it moves by."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
