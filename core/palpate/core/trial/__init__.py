"""Interface between a task and the loop: trial setup, snapshots, results."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
