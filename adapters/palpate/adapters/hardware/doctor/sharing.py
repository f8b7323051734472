"""Whether the devices of a rig get in each other's way."""

from __future__ import annotations

from typing import Final

from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.adapters.hardware.doctor.wiring import Wiring
from palpate.core.ports.values import CONTROL_RATE_HZ
from palpate.drivers.cia402.budget import HIGHEST_LOAD, BusBudget, frame_bits
from palpate.drivers.cia402.object_dictionary import HIGHEST_NODE, collisions

_HEARTBEAT_S: Final = 0.05
_HOST_NODE: Final = 126
"""What an arm's settings have when nothing else is said."""


def examine_sharing(arm: Wiring, sensor: Wiring, notes: Notebook) -> None:
    """Ports that both devices name, node numbers that collide, and the load of a CAN bus that they share."""
    if arm.serial is not None and arm.serial == sensor.serial:
        remedy = 'give each its own port; a CAN bus is shared through one adapter with interface = "socketcan"'
        notes.wrong(f"arm and force sensor both name {arm.serial}", remedy)
        return
    if arm.network is None or arm.network != sensor.network:
        notes.ok("arm and force sensor have a wire each")
        return
    if arm.bitrate != sensor.bitrate and arm.bitrate and sensor.bitrate:
        remedy = "a bus has one bit rate: the same in [arm] and [force_sensor], and in every device"
        notes.wrong(f"{arm.bitrate} and {sensor.bitrate} bit/s on the same bus {arm.network}", remedy)
    if arm.canopen_nodes and sensor.jr3_node is not None:
        _nodes(arm, sensor.jr3_node, notes)
        _load(arm, sensor, notes)


def _nodes(arm: Wiring, jr3_node: int, notes: Notebook) -> None:
    nodes = (*arm.canopen_nodes, _HOST_NODE)
    found = collisions(nodes, jr3_node)
    if not found:
        notes.ok(f"node {jr3_node} of the force sensor collides with no drive on {arm.network}")
        return
    free = next((n for n in range(1, HIGHEST_NODE + 1) if not collisions(nodes, n)), None)
    first = found[0]
    notes.wrong(
        f"node {jr3_node} of the force sensor is taken: 0x{first.identifier:03X} is {first.canopen} and the "
        f"sensor's {first.jr3} ({len(found)} identifiers in all)",
        f"compile another node number into the sensor's board, for example {free}",
    )


def _load(arm: Wiring, sensor: Wiring, notes: Notebook) -> None:
    if not arm.bitrate or not sensor.period_us:
        return
    budget = BusBudget(len(arm.canopen_nodes), arm.bitrate, _HEARTBEAT_S)
    cycles = budget.bits_per_cycle() * CONTROL_RATE_HZ / arm.divider
    readings = 2 * frame_bits(8) * 1e6 / sensor.period_us
    load = (cycles + readings) / arm.bitrate
    told = f"drives ({cycles:.0f} bit/s) and force sensor ({readings:.0f} bit/s) fill {load:.0%} of {arm.network}"
    remedy = "a larger [arm] divider, a longer [force_sensor] period_us, or a bus of its own for the sensor"
    notes.judge(load <= HIGHEST_LOAD, told, f"{told}, more than {HIGHEST_LOAD:.0%}", remedy)
