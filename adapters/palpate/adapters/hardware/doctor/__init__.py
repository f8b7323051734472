"""``palpate doctor``: what is to be said about the devices of a rig, and how to mend what is wrong."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
