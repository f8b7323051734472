"""MuJoCo model of the arm, peg and plate, with its contact geometry."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
