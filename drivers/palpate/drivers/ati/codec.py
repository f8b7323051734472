"""Requests, records and status words of the RDT protocol."""

import struct
from typing import Final

START, STOP = (struct.pack(">HHI", 0x1234, command, 0) for command in (2, 0))
"""Requests that start and stop an unlimited stream."""
RECORD: Final = struct.Struct(">3I6i")
"""Layout of a record: number, count and status, then force and torque in counts."""

SATURATED: Final = 1 << 17
_SUMMARY: Final = 1 << 31
_NO_FAULT: Final = SATURATED | 1 << 16
"""Bits that are not faults: saturation, which flags a sample, and bit 16, a threshold in the box's own monitor."""
_FAULTS: Final = {
    30: "CPU or RAM error", 29: "digital board error", 28: "analog board error",
    27: "serial link to the analog board failed", 26: "program memory does not verify",
    25: "halted by a configuration error", 24: "settings do not validate",
    23: "configuration does not fit the calibration", 22: "network communication failure",
    21: "CAN communication error", 20: "RDT communication error", 19: "EtherNet/IP failure", 18: "DeviceNet failure",
    14: "watchdog time-out", 13: "stack check error", 12: "EEPROM (I2C) failure", 11: "flash (SPI) failure",
    10: "analog board watchdog time-out", 9: "strain gauge excitation current too high",
    8: "strain gauge excitation current too low", 7: "analog ground out of range",
    6: "analog supply voltage too high", 5: "analog supply voltage too low",
    4: "no data from the serial link: transducer unplugged", 3: "reference voltage or power monitor error",
    2: "temperature error", 1: "HTTP failure",
}  # fmt: skip


def faults_in(status: int) -> tuple[str, ...]:
    """Return the names of the faults in a status word, most serious first."""
    bits = [bit for bit in range(30, -1, -1) if status & ~_NO_FAULT & 1 << bit]
    if not bits and status & _SUMMARY and not status & _NO_FAULT:
        bits = [31]
    return tuple(f"{_FAULTS.get(bit, 'unknown fault')} (bit {bit})" for bit in bits)
