"""How fast six CiA 402 drives can be cycled over emulated buses, against what the wire would allow.

    python -m benchmarks.cia402_rates

Three rows: *pump* is a thread that hands frames between python-can's virtual bus and the emulated drives at once, so
that it shows what both sides cost in one interpreter; *virtual* and *slcan* have the wire too, where every frame takes
its time at 1 Mbit/s, and slcan has the drives in a process of their own behind a pseudo-terminal.
"""

from __future__ import annotations

import multiprocessing
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection

import can
import numpy as np

from palpate.drivers.cia402.arm import Cia402Arm
from palpate.drivers.cia402.link import CanopenLink
from palpate.drivers.cia402.mailbox import ArmStatistics
from palpate.drivers.cia402.settings import ArmSettings, JointDrive, bits_per_cycle, bus_budget
from palpate.simulation.emulators.cia402.node import CanopenDrive
from palpate.simulation.emulators.lines.can_bus import EmulatedCanBus
from palpate.simulation.emulators.lines.slcan import SlcanServer
from tests.ideal_motors import IdealPlant
from tests.virtual_can import VirtualBusServer

NODES = (1, 2, 3, 4, 5, 6)
BITRATE = 1_000_000
CYCLES = 2000
TICK_S = 0.0001


def main() -> None:
    cia402_rates()


def cia402_rates() -> None:
    """Measure and print."""
    print(f"{'bus':8} {'enable':>8} {'cycles/s':>9} {'median':>8} {'p99':>8} {'max':>8} {'missed':>7}")
    for told, connect in {"pump": _pump, "virtual": _virtual, "slcan": _slcan}.items():
        with connect() as link:
            enable_s, rate, figures = _measure(link)
        shown = " ".join(f"{t * 1e-3:5.0f} us" for t in np.percentile(figures.round_trips_ns, (50, 99, 100)))
        missed = sum(node.missed for node in figures.nodes)
        print(f"{told:8} {1e3 * enable_s:5.0f} ms {rate:9.0f} {shown} {missed:7}")
    budget = bus_budget(len(NODES), BITRATE, 0.05)
    plain, worst = bits_per_cycle(len(NODES), stuffed=False), bits_per_cycle(len(NODES))
    print(f"a wire of {BITRATE} bit/s carries {BITRATE / plain:.0f} cycles/s of {plain} bits without stuff bits,")
    print(f"{BITRATE / worst:.0f} of {worst} at worst; the driver allows {budget.max_rate_Hz:.0f} (80 % load)")


def _measure(link: CanopenLink) -> tuple[float, float, ArmStatistics]:
    joints = tuple(
        JointDrive(node=node, counts_per_rad=30_557.75, lower_rad=-1.0, upper_rad=1.0, velocity_rad_per_s=1.0)
        for node in NODES
    )
    settings = ArmSettings(
        joints=joints, control_rate_Hz=140, answer_share=0.9, heartbeat_timeout_ms=1000, host_watchdog_ms=2000
    )
    arm = Cia402Arm(link, settings)
    arm.open()
    begin = time.perf_counter()
    arm.enable()
    enable_s = time.perf_counter() - begin
    begin = time.perf_counter()
    for _ in range(CYCLES):
        arm.cycle((0.005,) * len(NODES))
    rate = CYCLES / (time.perf_counter() - begin)
    figures = arm.statistics()
    arm.close()
    return enable_s, rate, figures


def _drives() -> list[CanopenDrive]:
    plant = IdealPlant()
    return [CanopenDrive(node, plant, axis) for axis, node in enumerate(NODES)]


def _wire() -> EmulatedCanBus:
    return EmulatedCanBus(_drives(), bit_rate_Hz=BITRATE, generator=np.random.default_rng(0))


@contextmanager
def _pump() -> Iterator[CanopenLink]:
    closing = threading.Event()

    def serve(bus: can.BusABC, drives: list[CanopenDrive]) -> None:
        while not closing.is_set():
            message = bus.recv(TICK_S)
            now_ns = time.monotonic_ns()
            for drive in drives:
                frames = drive.advance(now_ns) if message is None else []
                if message is not None:
                    frames = drive.feed(message.arbitration_id, bytes(message.data), now_ns)
                for frame in frames:
                    bus.send(can.Message(arbitration_id=frame.arbitration_id, data=frame.data, is_extended_id=False))

    channel = "cia402 rates pump"
    with can.Bus(interface="virtual", channel=channel) as bus:
        thread = threading.Thread(target=serve, args=(bus, _drives()))
        thread.start()
        try:
            with CanopenLink.open(interface="virtual", channel=channel, bitrate=BITRATE) as link:
                time.sleep(0.1)
                yield link
        finally:
            closing.set()
            thread.join()


@contextmanager
def _virtual() -> Iterator[CanopenLink]:
    channel = "cia402 rates virtual"
    with (
        VirtualBusServer(_wire(), channel, tick_s=TICK_S),
        CanopenLink.open(interface="virtual", channel=channel, bitrate=BITRATE) as link,
    ):
        time.sleep(0.1)
        yield link


@contextmanager
def _slcan() -> Iterator[CanopenLink]:
    ours, theirs = multiprocessing.Pipe()
    process = multiprocessing.get_context("spawn").Process(target=_serve, args=(theirs,), daemon=True)
    process.start()
    try:
        with CanopenLink.open(interface="slcan", channel=ours.recv(), bitrate=BITRATE, sleep_after_open=0.2) as link:
            yield link
    finally:
        ours.send(None)
        process.join()


def _serve(pipe: Connection) -> None:
    with SlcanServer(_wire(), generator=np.random.default_rng(0), tick_s=TICK_S) as server:
        pipe.send(server.channel)
        pipe.recv()


if __name__ == "__main__":
    main()
