"""The host's half of the NMC protocol, just enough to test the emulator with."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass

from palpate.simulation.emulators.motors.plant import JointPlant
from palpate.simulation.emulators.nmc.bus import NmcChain
from palpate.simulation.emulators.nmc.settings import ModuleSettings
from tests.support.ideal_motors import IdealPlant

TICK_NS = 512_000
ALL = 0xFF
GAINS = struct.pack("<hhhhBBhBB", 100, 1000, 0, 0, 255, 0, 4000, 1, 0)


def command(address: int, code: int, data: bytes = b"") -> bytes:
    body = bytes([address, len(data) << 4 | code]) + data
    return b"\xaa" + body + bytes([sum(body) % 256])


def trajectory(control: int, *fields: int) -> bytes:
    """Data of LOAD_TRAJ with fields of four bytes each."""
    return bytes([control]) + b"".join(struct.pack("<I", field % (1 << 32)) for field in fields)


def address_all(exchange: Callable[[bytes], bytes], modules: int = 6) -> None:
    for number in range(1, modules + 1):
        assert len(exchange(command(0, 0x1, bytes([number, ALL])))) == 2


@dataclass(frozen=True)
class Answer:
    status: int
    items: bytes


class Bench:
    """A bus in simulated time."""

    def __init__(
        self, settings: ModuleSettings | None = None, modules: int = 6, plant: JointPlant | None = None
    ) -> None:
        self.plant = IdealPlant()  # what most tests push and jam
        self.bus = NmcChain(plant or self.plant, settings, modules)
        self.now_ns = 0
        self.bus.advance(0)

    def addressed(self) -> Bench:
        address_all(self.raw, len(self.bus.modules))
        return self

    def running(self, *axes: int) -> Bench:
        """With the servos of some axes on (all six unless told)."""
        self.addressed()
        for address in [axis + 1 for axis in axes or range(len(self.bus.modules))]:
            self.ask(address, 0x6, GAINS)
            self.ask(address, 0x7, b"\x05")
            self.ask(address, 0xB)
        return self

    def raw(self, data: bytes) -> bytes:
        return self.bus.feed(data, self.now_ns)

    def ask(self, address: int, code: int, data: bytes = b"") -> Answer:
        reply = self.raw(command(address, code, data))
        assert sum(reply[:-1]) % 256 == reply[-1]
        return Answer(reply[0], reply[1:-1])

    def tell(self, address: int, code: int, data: bytes = b"") -> None:
        assert self.raw(command(address, code, data)) == b""

    def read(self, address: int, mask: int) -> bytes:
        return self.ask(address, 0x3, bytes([mask])).items

    def position(self, address: int) -> int:
        (counts,) = struct.unpack("<i", self.read(address, 0x01))
        return int(counts)

    def status(self, address: int) -> int:
        return self.ask(address, 0xE).status

    def auxiliary(self, address: int) -> int:
        return self.read(address, 0x08)[0]

    def wait(self, ticks: int) -> None:
        self.now_ns += ticks * TICK_NS
        self.bus.advance(self.now_ns)

    def ticks_until(self, done: Callable[[], bool], limit: int = 20_000) -> int:
        for ticks in range(limit):
            if done():
                return ticks
            self.wait(1)
        raise AssertionError("it never happened")
