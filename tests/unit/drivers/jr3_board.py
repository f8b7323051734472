"""A scripted board at the other end of a fake link, and a clock that advances only on request."""

import struct

from palpate.drivers.can.link import CanFrame
from palpate.drivers.errors import SilentError
from palpate.drivers.jr3 import Jr3
from palpate.drivers.jr3.phases import Jr3Phase

MS = 1_000_000
FORCES_N, MOMENTS_DNM = (115, 111, 185), (56, 52, 61)
OPS = {0x200: "start", 0x280: "stop", 0x300: "zero", 0x400: "state", 0x480: "force scales", 0x500: "moment scales"}


def forces(counter, x=0, y=0, z=1000, node=1):
    return CanFrame(0x600 + node, struct.pack("<3hH", x, y, z, counter))


def moments(counter, x=0, y=0, z=0, node=1):
    return CanFrame(0x680 + node, struct.pack("<3hH", x, y, z, counter))


class FakeCanLink:
    """Answers as the board of node 1 by default."""

    def __init__(self):
        self.garbled = self.bus_offs = self.send_failures = 0
        self.inbox = []
        self.requested = []
        self.mute = set()
        self.state = 0
        self.broken = False
        self.answer = lambda _: None

    def receive(self):
        if self.broken:
            raise SilentError("fake", "cable pulled", "plug it in")
        frames, self.inbox = self.inbox, []
        return frames

    def send(self, frame):
        name = OPS[frame.can_id & 0x780]
        self.requested.append(name)
        if name in self.mute:
            return True
        scripted = self.answer(name)
        self.inbox += self.ack(name) if scripted is None else scripted
        return True

    def ack(self, name):
        scales = {"force scales": FORCES_N, "moment scales": MOMENTS_DNM}.get(name, ())
        return [CanFrame(0x101, bytes([self.state]) + struct.pack(f"<{len(scales)}H", *scales))]


class Bench:
    """A sensor on a fake link, with a clock of its own."""

    def __init__(self, cutoff_Hz=50.0):
        self.link = FakeCanLink()
        self.device = Jr3(self.link, 1, cutoff_Hz=cutoff_Hz, period_us=10_000)
        self.now_ns = 1_000 * MS
        self.counter = 0

    def clock_ns(self):
        return self.now_ns

    def sleep(self, seconds):
        self.now_ns += round(seconds * 1e9)

    def poll(self, after_ms=1.0):
        self.now_ns += round(after_ms * MS)
        return self.device.poll(self.now_ns)

    def polls(self, times, after_ms=1.0):
        return [sample for _ in range(times) for sample in self.poll(after_ms)]

    def read(self, z=1000, step=78):
        """The board's next reading, 10 ms later."""
        self.counter = (self.counter + step) % 0x10000
        self.link.inbox += [forces(self.counter, z=z), moments(self.counter)]
        return self.poll(10.0)

    def streaming(self):
        self.device.open()
        self.polls(8)
        assert self.device.phase is Jr3Phase.AWAITING
        self.read()
        assert self.device.phase is Jr3Phase.STREAMING
        return self
