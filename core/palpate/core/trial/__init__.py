"""What a task and the loop that runs it have in common: how a trial begins, what a tick gives, what comes of it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
