"""Identifiers on a CAN bus: those of CANopen and of the JR3 firmware, and where they collide.

Standard knowledge, CiA 301 (predefined connection set). FACT (README of jr3-mbed-firmware-can): the board's identifiers
are an operation plus its node number.
"""

import enum
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

NMT: Final = 0x000
SYNC: Final = 0x080
EMCY: Final = 0x080
TPDO1: Final = 0x180
RPDO1: Final = 0x200
SDO_ANSWER: Final = 0x580
SDO_REQUEST: Final = 0x600
HEARTBEAT: Final = 0x700
HIGHEST_NODE: Final = 127

CANOPEN_NODE_CODES: Final = {
    EMCY: "EMCY",
    TPDO1: "TPDO1",
    RPDO1: "RPDO1",
    0x280: "TPDO2",
    0x300: "RPDO2",
    0x380: "TPDO3",
    0x400: "RPDO3",
    0x480: "TPDO4",
    0x500: "RPDO4",
    SDO_ANSWER: "SDO answer",
    SDO_REQUEST: "SDO request",
    HEARTBEAT: "heartbeat",
}
"""What stands in front of a node number in CANopen's predefined connection set."""


class Jr3Code(enum.IntEnum):
    """What stands in front of the node number of a JR3 board.

    Its SYNC is 0x080 alone, as CANopen's is: one SYNC serves both, on purpose.
    """

    ACK = 0x100
    START_SYNC = 0x180
    START_ASYNC = 0x200
    STOP = 0x280
    ZERO_OFFS = 0x300
    SET_FILTER = 0x380
    GET_STATE = 0x400
    GET_FS_FORCES = 0x480
    GET_FS_MOMENTS = 0x500
    RESET = 0x580
    FORCES = 0x600
    MOMENTS = 0x680
    BOOTUP = 0x700
    GRIPPER_PWM = 0x780


@dataclass(frozen=True, slots=True)
class Collision:
    """One identifier with two meanings."""

    identifier: int
    canopen: str
    jr3: str


def collisions(canopen_nodes: Iterable[int], jr3_node: int) -> tuple[Collision, ...]:
    """Every identifier that both a CANopen node and a JR3 node use, in ascending order."""
    sensor = {code + jr3_node: code.name for code in Jr3Code}
    drives = [
        (code + node, f"{name} of node {node}") for node in canopen_nodes for code, name in CANOPEN_NODE_CODES.items()
    ]
    return tuple(Collision(i, name, sensor[i]) for i, name in sorted(drives) if i in sensor)
