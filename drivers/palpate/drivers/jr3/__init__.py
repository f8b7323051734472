"""Driver for a JR3 force/torque sensor behind the public Mbed board firmware, over CAN or a serial line.

==========================  ===================================================================================
``messages``                what host and board say to each other, whatever the wire
``codec_can``               CAN frames to messages and back
``codec_uart``              serial bytes to messages and back
``joiner``, ``counter``     FORCES and MOMENTS made one reading; the 16-bit frame counter made a sequence number
``scaling``, ``sample``     counts made newtons and newton metres
``settings``                what a user may choose, and checks of it
``phases``, ``exchange``    the conversation's table of transitions, and its one request in flight
``device``, ``sampling``    the conversation itself, advanced by polling, and the samples that come of it
``verdicts``, ``blocking``  which error it is; helpers that wait
``links``, ``wires``        python-can buses and serial ports; link and codec put together
``statistics``              what a health check wants to know
==========================  ===================================================================================

Statements about the device carry a mark: FACT is read in the source that is named, CALC is arithmetic on facts,
INFERENCE is our reading, and "assumed" has no source at all. Nothing here has met real hardware.
"""
