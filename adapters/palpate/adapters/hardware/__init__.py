"""Rigs of real devices: adapters of the drivers, the arm's process, operator's stop, doctor, and the emulated cell."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
