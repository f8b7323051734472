"""The host's half of the NMC protocol, just enough to test the emulator with."""

import struct
from dataclasses import dataclass

from palpate.simulation.emulators.nmc.bus import NmcChain
from tests.support.ideal_motors import IdealPlant

TICK_NS = 512_000
ALL = 0xFF
GAINS = struct.pack("<hhhhBBhBB", 100, 1000, 0, 0, 255, 0, 4000, 1, 0)


def command(address, code, data=b""):
    body = bytes([address, len(data) << 4 | code]) + data
    return b"\xaa" + body + bytes([sum(body) % 256])


def address_all(exchange, modules=6):
    for number in range(1, modules + 1):
        assert len(exchange(command(0, 0x1, bytes([number, ALL])))) == 2


@dataclass(frozen=True)
class Answer:
    status: int
    items: bytes


class Bench:
    """A bus in simulated time."""

    def __init__(self, modules=6):
        self.plant = IdealPlant()
        self.bus = NmcChain(self.plant, modules)
        self.now_ns = 0
        self.bus.advance(0)

    def addressed(self):
        address_all(self.raw, len(self.bus.modules))
        return self

    def running(self, *axes):
        """Switch on the servos of some axes (by default all six)."""
        self.addressed()
        for address in [axis + 1 for axis in axes or range(len(self.bus.modules))]:
            self.ask(address, 0x6, GAINS)
            self.ask(address, 0x7, b"\x05")
            self.ask(address, 0xB)
        return self

    def raw(self, data):
        return self.bus.feed(data, self.now_ns)

    def ask(self, address, code, data=b""):
        reply = self.raw(command(address, code, data))
        assert sum(reply[:-1]) % 256 == reply[-1]
        return Answer(reply[0], reply[1:-1])

    def read(self, address, mask):
        return self.ask(address, 0x3, bytes([mask])).items

    def status(self, address):
        return self.ask(address, 0xE).status

    def auxiliary(self, address):
        return self.read(address, 0x08)[0]

    def wait(self, ticks):
        self.now_ns += ticks * TICK_NS
        self.bus.advance(self.now_ns)
