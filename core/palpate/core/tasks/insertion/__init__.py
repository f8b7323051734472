"""The insertion task: its phases, the exploring agent, and its controllers."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
