"""Driver for the Zebra Zero arm with six PIC-SERVO modules; :mod:`palpate.drivers.nmc` describes the bus and the marks.

Sources: *client* is ``client/arm.py`` of brendandburns/zebra-zero; *port* is brendandburns/ros2_zebra_zero. Both drive
one real arm. NOT FOUND: the maker's data sheet, payload, repeatability, and whether limit switches are wired.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
