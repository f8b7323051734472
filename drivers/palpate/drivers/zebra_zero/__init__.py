"""The Zebra Zero arm, six joints on six PIC-SERVO modules; see :mod:`palpate.drivers.nmc` for the bus and the marks.

Sources: *client* is ``client/arm.py`` of brendandburns/zebra-zero; *port* is brendandburns/ros2_zebra_zero. Both drive
one real arm. NOT FOUND: the maker's data sheet, payload, repeatability, and whether limit switches are wired.
"""
