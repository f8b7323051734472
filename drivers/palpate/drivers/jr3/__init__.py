"""Driver for a JR3 force/torque sensor behind the public Mbed board firmware, over CAN or a serial line.

===================  ==========================================================================================
``messages``         what host and board send each other, whatever the wire
``codec_can``        CAN frames to messages and back; FORCES and MOMENTS made one reading
``codec_uart``       serial bytes to messages and back
``transport``        ways to the board: a CAN bus or a serial port, with its codec
``phases``           the conversation's table of transitions, and its one request in flight
``device``           the conversation itself, advanced by polling
``sampling``         samples from readings: frame counter, scaling, marks
``settings``         what a user may choose, and checks of it
``blocking``         helpers that wait
``health``           counters for a health check, and which error it is
===================  ==========================================================================================

Statements about the device carry a mark: FACT is read in the source that is named, CALC is arithmetic on facts,
INFERENCE is our reading, and "assumed" has no source at all. Nothing here has met real hardware.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
