"""Identifiers on the bus, and which of them a drive and a force sensor would fight over.

FACT: CANopen's predefined identifiers are function code + node (``canopen`` 2.4.1: SDO 0x580/0x600, heartbeat
0x700, EMCY 0x080, PDO 1 to 4 from 0x180); the JR3 CAN firmware uses operation + node with operations of the same
spacing (``roboticslab-uc3m/jr3-mbed-firmware-can``, ``main.cpp`` at 2184b65).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from palpate.drivers.errors import SettingError

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

JR3_NODE_CODES: Final = {
    0x100: "ACK",
    0x180: "START_SYNC",
    0x200: "START_ASYNC",
    0x280: "STOP",
    0x300: "ZERO_OFFS",
    0x380: "SET_FILTER",
    0x400: "GET_STATE",
    0x480: "GET_FS_FORCES",
    0x500: "GET_FS_MOMENTS",
    0x580: "RESET",
    0x600: "FORCES",
    0x680: "MOMENTS",
    0x700: "BOOTUP",
    0x780: "GRIPPER_PWM",
}
"""The same of the JR3 firmware. Its SYNC is 0x080 alone, as CANopen's is: one SYNC serves both, on purpose."""


@dataclass(frozen=True, slots=True)
class Collision:
    """One identifier with two meanings.

    Attributes:
        identifier: On the bus, 11 bits.
        canopen: What it means to the drive or to the host.
        jr3: What it means to the sensor.
    """

    identifier: int
    canopen: str
    jr3: str


def collisions(canopen_nodes: Iterable[int], jr3_node: int) -> tuple[Collision, ...]:
    """Every identifier that both a CANopen node and a JR3 node use, in ascending order."""
    sensor = {code + jr3_node: name for code, name in JR3_NODE_CODES.items()}
    drives = [
        (code + node, f"{name} of node {node}") for node in canopen_nodes for code, name in CANOPEN_NODE_CODES.items()
    ]
    return tuple(Collision(i, name, sensor[i]) for i, name in sorted(drives) if i in sensor)


def require_no_collision(canopen_nodes: Iterable[int], jr3_node: int) -> None:
    """Refuse a JR3 sensor whose frames would be taken for a drive's, or the other way round.

    Args:
        canopen_nodes: Node numbers of all drives and of the host's own heartbeat.
        jr3_node: Node number of the sensor on the same bus.

    Raises:
        SettingError: They share an identifier, or the sensor's node number is not 1 to 127.
    """
    if not 1 <= jr3_node <= HIGHEST_NODE:
        raise SettingError("JR3 sensor", f"node number {jr3_node} does not exist", f"use 1 to {HIGHEST_NODE}")
    nodes = tuple(canopen_nodes)
    found = collisions(nodes, jr3_node)
    if found:
        told = ", ".join(f"0x{c.identifier:03X} is {c.canopen} and the sensor's {c.jr3}" for c in found)
        free = next(n for n in range(1, HIGHEST_NODE + 1) if not collisions(nodes, n))
        raise SettingError(
            "JR3 sensor", f"node {jr3_node} is taken: {told}", f"give the sensor node {free}, for example"
        )
