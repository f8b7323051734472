"""Prints how fast emulated JR3 nodes stream: ``python -m benchmarks.can_rates`` from the repository's root.

Computed is what the asked period and the bit rate of the bus allow; achieved is what a reader in the same process
received through python-can. Several nodes share one bus.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from uuid import uuid4

import can
import numpy as np

from palpate.simulation.emulators.jr3.can import Jr3CanNode
from palpate.simulation.emulators.jr3.sensor import Jr3Config
from palpate.simulation.emulators.lines.can_bus import EmulatedCanBus, frame_bits
from palpate.simulation.emulators.lines.slcan import SlcanServer
from tests.virtual_can import VirtualBusServer

NODES_AND_PERIODS_us = ((1, 7143), (1, 1000), (1, 500), (1, 300), (2, 1000), (4, 1000), (4, 500))
DURATION_s = 3.0
WARM_UP_s = 0.3


@dataclass(frozen=True)
class Rates:
    """Pairs of FORCES and MOMENTS a second over all nodes, and how late they came."""

    computed_Hz: float
    achieved_Hz: float
    lost: int
    gap_p50_ms: float
    gap_p99_ms: float
    gap_max_ms: float


def wire_of(nodes: int) -> EmulatedCanBus:
    config = Jr3Config(boot_ns=0, eeprom_ns=0)
    load = (10.0, -5.0, 20.0, 0.1, -0.2, 0.3)
    devices = [
        Jr3CanNode(node, lambda _: load, config, generator=np.random.default_rng(node)) for node in range(1, nodes + 1)
    ]
    return EmulatedCanBus(devices, generator=np.random.default_rng(0))


@contextmanager
def virtual(wire: EmulatedCanBus) -> Iterator[can.BusABC]:
    channel = f"rates-{uuid4()}"
    with can.Bus(interface="virtual", channel=channel) as bus, VirtualBusServer(wire, channel):
        yield bus


@contextmanager
def slcan(wire: EmulatedCanBus) -> Iterator[can.BusABC]:
    with (
        SlcanServer(wire, generator=np.random.default_rng(0)) as server,
        can.Bus(interface="slcan", channel=server.channel, bitrate=wire.bit_rate_Hz, sleep_after_open=0.0) as bus,
    ):
        yield bus


def computed_Hz(nodes: int, period_us: int) -> float:
    """Pairs a second that the periods ask for, or the bus carries, whichever is less."""
    bus_Hz = 1e6 / (2 * frame_bits(8))
    return min(nodes * 1e6 / period_us, bus_Hz)


def measure(bus: can.BusABC, nodes: int, period_us: int, duration_s: float) -> Rates:
    time.sleep(0.05)
    for node in range(1, nodes + 1):
        start = can.Message(arbitration_id=0x200 + node, data=struct.pack("<HI", 1000, period_us), is_extended_id=False)
        bus.send(start)
        time.sleep(0.01)
    begin_s = time.perf_counter() + WARM_UP_s
    forces: dict[int, bytes] = {}
    arrivals: dict[int, list[float]] = {node: [] for node in range(1, nodes + 1)}
    lost = 0
    while (now_s := time.perf_counter()) < begin_s + duration_s:
        message = bus.recv(0.1)
        if message is None or now_s < begin_s:
            continue
        operation, node = message.arbitration_id & ~0x7F, message.arbitration_id & 0x7F
        if operation == 0x600:
            forces[node] = bytes(message.data[6:])
        elif operation == 0x680 and forces.get(node) == message.data[6:]:
            arrivals[node].append(time.perf_counter())
        elif operation == 0x680 and node in forces:
            lost += 1
    gaps_ms = np.concatenate([np.diff(times) for times in arrivals.values()]) * 1e3
    achieved_Hz = sum(len(times) for times in arrivals.values()) / duration_s
    p50, p99, largest = np.percentile(gaps_ms, [50, 99, 100])
    return Rates(computed_Hz(nodes, period_us), achieved_Hz, lost, float(p50), float(p99), float(largest))


def can_rates(duration_s: float = DURATION_s) -> None:
    """Print a line for each number of nodes and period, on both kinds of bus."""
    print("bus      nodes  period us  computed Hz  achieved Hz  lost  gap ms: median     p99     max")
    for name, served in (("virtual", virtual), ("slcan", slcan)):
        for nodes, period_us in NODES_AND_PERIODS_us:
            with served(wire_of(nodes)) as bus:
                rates = measure(bus, nodes, period_us, duration_s)
            print(
                f"{name:8} {nodes:5} {period_us:10} {rates.computed_Hz:12.0f} {rates.achieved_Hz:12.0f}"
                f" {rates.lost:5} {rates.gap_p50_ms:15.2f} {rates.gap_p99_ms:7.2f} {rates.gap_max_ms:7.2f}"
            )


if __name__ == "__main__":
    can_rates()
