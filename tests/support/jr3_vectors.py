"""Golden frames of the JR3 board on CAN, node 1, for driver and emulator alike: (identifier, payload in hexadecimal).

Source: README and main.cpp of roboticslab-uc3m/jr3-mbed-firmware-can (2184b65).
"""

START = 0x201, "C80010270000"
"""``cansend can0 201#C80010270000``: asynchronous, 2 Hz, 10 ms."""
STOP = 0x281, ""
GET_STATE = 0x401, ""
GET_FORCE_SCALES = 0x481, ""
GET_MOMENT_SCALES = 0x501, ""

READY = 0x101, "00"
NOT_INITIALISED = 0x101, "01"
FORCE_SCALES = 0x101, "0073006F00B900"
"""115, 111, 185 N: the wrist sensor of can-plotter.py."""
MOMENT_SCALES = 0x101, "00380034003D00"
"""5.6, 5.2, 6.1 N m."""
BOOTUP = 0x701, ""
FORCES = 0x601, "0100FFFF0080FFFF"
"""1, -1, -32768 counts; counter 65535."""
MOMENTS = 0x681, "FF7F000001000200"
"""32767, 0, 1 counts; counter 2."""
