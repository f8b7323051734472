"""The NMC serial bus of PIC-SERVO motor controllers: codec, communication and start-up.

Marks in this package: FACT comes from the named source, CALC is calculated from facts, INFERENCE is interpretation.
Sources: *libnmc* is the NMC library of the public ROS 2 port brendandburns/ros2_zebra_zero; *PyLabRobot* is the module
``agilent/vspin/_nmc.py`` of that project, with tests; *Logosol* refers to the manuals of the compatible LS-231 and
LS-173AP drives; *data sheet* refers to the PIC-SERVO SC by J. R. Kerr.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
