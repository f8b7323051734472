"""Prints how fast the emulated buses run: ``python -m benchmarks.bus_rates`` from the repository's root."""

from __future__ import annotations

import struct
import time
from dataclasses import dataclass
from math import ceil

import serial

from palpate.simulation.emulators.lines.pty_server import PtyServer
from palpate.simulation.emulators.lines.serial_line import LineSpeed
from palpate.simulation.emulators.nmc.bus import NmcChain
from tests.ideal_motors import IdealPlant

CYCLES = 200
AXES = 6
BITS_PER_BYTE = 10
DIVISORS = {19_200: 63, 57_600: 20, 115_200: 10, 230_400: 5}


@dataclass(frozen=True)
class Case:
    """A line and what is exchanged on it with each axis: a position-only LOAD_TRAJ and a reply with a position."""

    label: str
    baud: int
    timing: LineSpeed

    def computed_Hz(self, bytes_per_exchange: int) -> float:
        """Six-axis cycles in a second that the line allows."""
        if not self.timing.paced:
            return float("inf")
        exchange_s = bytes_per_exchange * BITS_PER_BYTE / self.baud
        if latency_s := self.timing.usb_latency_s:
            exchange_s = ceil(exchange_s / latency_s) * latency_s
        return 1.0 / (AXES * exchange_s)


NMC_CASES = (
    Case("no line delay", 115_200, LineSpeed(paced=False)),
    Case("57600", 57_600, LineSpeed()),
    Case("115200", 115_200, LineSpeed()),
    Case("230400", 230_400, LineSpeed()),
    Case("115200, USB 1 ms", 115_200, LineSpeed(usb_latency_s=0.001)),
    Case("115200, USB 16 ms", 115_200, LineSpeed(usb_latency_s=0.016)),
)


def nmc_rates(cycles: int = CYCLES) -> None:
    """Six-axis cycles in a second over an emulated NMC bus, as the wire allows and as achieved."""
    print("NMC, six axes, 9 + 6 bytes each")
    print(f"{'line':<20}{'computed Hz':>12}{'achieved Hz':>12}")
    for case in NMC_CASES:
        runs = max(5, cycles // 10) if case.timing.usb_latency_s > 0.01 else cycles
        achieved_Hz, size = _nmc_cycles_per_s(case, runs)
        print(f"{case.label:<20}{case.computed_Hz(size):>12.1f}{achieved_Hz:>12.1f}")


def _nmc_cycles_per_s(case: Case, cycles: int) -> tuple[float, int]:
    set_point = b"\x11" + struct.pack("<i", 0)
    frames = [_nmc_command(number, 0x4, set_point) for number in range(1, AXES + 1)]
    with (
        PtyServer(NmcChain(IdealPlant()), case.timing) as server,
        serial.Serial(server.path, baudrate=19_200, timeout=1.0) as port,
    ):
        for number in range(1, AXES + 1):
            port.write(_nmc_command(0, 0x1, bytes([number, 0xFF])))
            port.read(2)
            port.write(_nmc_command(number, 0x2, b"\x01"))
            port.read(6)
        port.write(_nmc_command(0xFF, 0xA, bytes([DIVISORS[case.baud]])))
        time.sleep(0.05)
        port.baudrate = case.baud
        start = time.perf_counter()
        for _ in range(cycles):
            for frame in frames:
                port.write(frame)
                if len(port.read(6)) != 6:
                    raise TimeoutError("the emulated bus did not answer")
        return cycles / (time.perf_counter() - start), len(frames[0]) + 6


def _nmc_command(address: int, code: int, data: bytes) -> bytes:
    body = bytes([address, len(data) << 4 | code]) + data
    return b"\xaa" + body + bytes([sum(body) & 0xFF])


if __name__ == "__main__":
    nmc_rates()
