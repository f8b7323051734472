"""Proofs of contact, whatever the task: is the force that is measured the force that there is?"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
