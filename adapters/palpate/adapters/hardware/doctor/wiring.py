"""Which wire a device of a rig file hangs on."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from palpate.adapters.config import DeviceEntry, overlay
from palpate.adapters.hardware.ati import NetFtTable
from palpate.adapters.hardware.cia402 import Cia402Table
from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.adapters.hardware.jr3 import Jr3CanTable
from palpate.adapters.hardware.ur import UrTable
from palpate.adapters.hardware.zebra_zero import ZebraTable
from palpate.core.ports import CONTROL_RATE_HZ
from palpate.drivers.can import HIGHEST_NODE, collisions
from palpate.drivers.cia402 import HIGHEST_LOAD, bits_per_cycle, frame_bits


@dataclass(frozen=True)
class Wiring:
    """The way to a device, as far as the rig file has it.

    Attributes:
        serial: Device of a serial port, a CAN adapter's too; None where there is none.
        network: Name of a CAN network interface; None where there is none.
        canopen_nodes: Nodes of CANopen devices that are on it, this computer's last.
        jr3_node: Node of a JR3 on it; None without one on CAN.
        period_us: Time between the readings of that JR3, in microseconds.
        bitrate: Of a CAN bus, in bit/s; 0 where unknown.
    """

    serial: str | None = None
    network: str | None = None
    told: str = "the rig file names no port"
    canopen_nodes: tuple[int, ...] = ()
    jr3_node: int | None = None
    period_us: int = 0
    bitrate: int = 0
    divider: int = 1


def wiring_of(entry: DeviceEntry) -> Wiring:
    """The wire of a device; of a stranger's by the usual names: ``host``, ``port``, ``interface``, ``channel``."""
    return _KNOWN.get(entry.adapter, _guessed)(entry.settings)


def _zebra(settings: Mapping[str, Any]) -> Wiring:
    table = overlay(ZebraTable(), settings)
    return Wiring(table.port, told=f"{table.port}, 8N1, {table.baud} baud asked for")


def _cia402(settings: Mapping[str, Any]) -> Wiring:
    table = overlay(Cia402Table(), settings)
    nodes = tuple(table.nodes)
    told = f"nodes {', '.join(map(str, nodes))}"
    return _can(table.bus, told, canopen_nodes=(*nodes, table.host_node), divider=table.divider)


def _jr3_can(settings: Mapping[str, Any]) -> Wiring:
    table = overlay(Jr3CanTable(), settings)
    return _can(table.bus, f"node {table.node}", jr3_node=table.node, period_us=table.period_us)


def _ati_netft(settings: Mapping[str, Any]) -> Wiring:
    table = overlay(NetFtTable(), settings)
    return Wiring(told=f"{table.host}, UDP port {table.port}, its page on port {table.http_port}")


def _ur(settings: Mapping[str, Any]) -> Wiring:
    return Wiring(told=f"{settings.get('host', UrTable().host)}, TCP ports 30004 (RTDE), 30003 and 29999")


def _can(bus: Mapping[str, Any], told: str, **more: Any) -> Wiring:
    interface, channel = str(bus["interface"]), str(bus["channel"])
    serial = channel.split("@")[0] if interface == "slcan" else None
    told = f"{interface} {channel}, {bus['bitrate']} bit/s, {told}"
    network = channel if interface == "socketcan" else None
    return Wiring(serial, network, told, bitrate=bus["bitrate"], **more)


def _guessed(settings: Mapping[str, Any]) -> Wiring:
    port, interface, channel = (settings.get(name) for name in ("port", "interface", "channel"))
    if isinstance(interface, str) and isinstance(channel, str):
        return replace(_can({**settings, "bitrate": 0}, ""), told=f"{interface} {channel}")
    if isinstance(port, str):
        return Wiring(port, told=port)
    host = settings.get("host")
    return Wiring(told=f"{host}, port {port}") if isinstance(host, str) and isinstance(port, int) else Wiring()


_KNOWN: Final[Mapping[str, Callable[[Mapping[str, Any]], Wiring]]] = {
    "zebra-nmc": _zebra, "cia402": _cia402, "jr3-can": _jr3_can,
    "ati-netft": _ati_netft, "ur-rtde": _ur,
}  # fmt: skip


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
    nodes = arm.canopen_nodes
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
    cycles = bits_per_cycle(len(arm.canopen_nodes) - 1) * CONTROL_RATE_HZ / arm.divider
    readings = 2 * frame_bits(8) * 1e6 / sensor.period_us
    load = (cycles + readings) / arm.bitrate
    told = f"drives ({cycles:.0f} bit/s) and force sensor ({readings:.0f} bit/s) fill {load:.0%} of {arm.network}"
    remedy = "a larger [arm] divider, a longer [force_sensor] period_us, or a bus of its own for the sensor"
    notes.judge(load <= HIGHEST_LOAD, told, f"{told}, more than {HIGHEST_LOAD:.0%}", remedy)
