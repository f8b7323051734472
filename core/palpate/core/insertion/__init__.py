"""The insertion task: its phases, the agent that explores, its frame and settings, and what it expects of a tick."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
