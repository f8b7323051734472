"""A line with modules at its far end, and a clock of its own: what the tests of the bus and of the arm talk to.

Written against the protocol's tables, not against the driver: it shares no code with it.
"""

import struct
from dataclasses import dataclass, field

RATES = {63: 19_200, 20: 57_600, 10: 115_200, 5: 230_400, 4: 250_000}
FIELDS = ((0x01, 4), (0x02, 1), (0x04, 2), (0x08, 1), (0x10, 4), (0x20, 2), (0x40, 2), (0x80, 1))


class Clock:
    def __init__(self):
        self.ns = 1_000_000_000
        self.slept_s = []

    def __call__(self):
        return self.ns

    def sleep(self, duration_s):
        self.slept_s.append(duration_s)
        self.ns += round(duration_s * 1e9)


@dataclass
class Module:
    """One servo module; it reaches every target at once unless ``speed_counts`` says how far it gets per frame."""

    kind: int = 0
    version: int = 10
    address: int = 0
    group: int = 0xFF
    baud: int = 19_200
    mask: int = 0
    counts: int = 0
    target: int = 0
    is_on: bool = False
    pos_error: bool = True
    overcurrent: bool = False
    power: bool = True
    limit: bool = False
    overrun: bool = False
    speed_counts: int | None = None
    home: int = 0
    seen: list[tuple[int, bytes]] = field(default_factory=list)
    resets: int = 0

    def reset(self):
        self.address, self.group, self.mask, self.baud = 0, 0xFF, 0, 19_200
        self.counts = self.target = 0
        self.is_on, self.pos_error, self.overcurrent, self.overrun = False, True, False, False
        self.resets += 1

    @property
    def status(self):
        is_done = self.counts == self.target or not self.is_on
        return (
            is_done
            | self.overcurrent << 2
            | self.power << 3
            | (self.pos_error or not self.is_on) << 4
            | self.limit << 5
        )

    @property
    def aux(self):
        return self.is_on << 2 | self.overrun << 5

    def reply(self, mask):
        body = bytes((self.status,))
        values = {
            0x01: struct.pack("<i", self.counts),
            0x02: b"\x07",
            0x04: b"\0\0",
            0x08: bytes((self.aux,)),
            0x10: struct.pack("<i", self.home),
            0x20: bytes((self.kind, self.version)),
            0x40: struct.pack("<h", 0),
            0x80: b"\0",
        }
        body += b"".join(values[bit] for bit, _ in FIELDS if mask & bit)
        return body + bytes((sum(body) % 256,))

    def obey(self, code, data):
        self.seen.append((code, data))
        reply = None
        if code == 0xF:
            self.reset()
            return None
        if code == 0xA:
            self.baud = RATES[data[0]]
            return None
        if code == 0x3:
            reply = self.reply(data[0])
        if code == 0x2:
            self.mask = data[0]
        if code == 0x0:
            self.counts = self.target = 0
        if code == 0x1:
            self.address, self.group = data[0], data[1] | 0x80
        if code == 0xB:
            self.pos_error = self.overcurrent = self.overrun = False
        if code == 0x7:
            self._stop(data)
        if code == 0x4 and data[0] & 0x91 == 0x91:
            self.target = struct.unpack_from("<i", data, 1)[0]
        reply = self.reply(self.mask) if reply is None else reply
        self._move()
        return reply

    def _stop(self, data):
        control = data[0]
        if control & 0x02:
            self.is_on = False
        elif control & 0x10:
            self.target = struct.unpack_from("<i", data, 1)[0]
        elif control & 0x0C:
            self.is_on, self.target = True, self.counts

    def _move(self):
        if not self.is_on or not self.power:
            return
        gap = self.target - self.counts
        room = abs(gap) if self.speed_counts is None else min(abs(gap), self.speed_counts)
        self.counts += room if gap >= 0 else -room


class Line:
    """Byte stream of the host. ``mangle`` gets every reply and says what arrives of it, and when."""

    def __init__(self, modules=None, clock=None):
        self.modules = [Module() for _ in range(6)] if modules is None else modules
        self.clock = Clock() if clock is None else clock
        self.baudrate = 9600
        self.timeout = None
        self.arriving = []
        self.sent = []
        self.rest = b""
        self.mangle = lambda reply: [(0.0, reply)]
        self.gone = None
        self.is_echo = False
        self.turnaround_s = 0.0005
        self.flushes = 0

    def _buffer(self):
        return b"".join(data for when, data in self.arriving if when <= self.clock.ns)

    @property
    def in_waiting(self):
        self._check()
        return len(self._buffer())

    def read(self, size=1, /):
        self._check()
        deadline = self.clock.ns + round((self.timeout or 0.0) * 1e9)
        while len(self._buffer()) < size and self.clock.ns < deadline:
            later = [when for when, _ in self.arriving if self.clock.ns < when <= deadline]
            self.clock.ns = min(later, default=deadline)
        arrived = self._buffer()
        self.arriving = [entry for entry in self.arriving if entry[0] > self.clock.ns]
        if arrived[size:]:
            self.arriving.insert(0, (0, arrived[size:]))
        return arrived[:size]

    def reset_input_buffer(self):
        self._check()
        self.flushes += 1
        self.arriving = [entry for entry in self.arriving if entry[0] > self.clock.ns]

    def write(self, data, /):
        self._check()
        self.sent.append(data)
        if self.is_echo:
            self.arriving.append((self.clock.ns, data))
            return len(data)
        self.rest += data
        while self.rest:
            if self.rest[0] != 0xAA:
                self.rest = self.rest[1:]
                continue
            if len(self.rest) < 4 or len(self.rest) < 4 + (self.rest[2] >> 4):
                break
            end = 4 + (self.rest[2] >> 4)
            frame, self.rest = self.rest[:end], self.rest[end:]
            if sum(frame[1:-1]) % 256 == frame[-1]:
                self._deliver(frame[1], frame[2] & 0x0F, frame[3:-1])
        return len(data)

    def put(self, data, after_s=0.0):
        self.arriving.append((self.clock.ns + round(after_s * 1e9), data))

    def _deliver(self, address, code, data):
        heard = [m for m in self.modules if m.baud == self.baudrate]
        single = next((m for m in heard if m.address == address), None)
        if address >= 0x80:
            for module in heard:
                if module.group == address:
                    module.obey(code, data)
        elif single is not None:
            reply = single.obey(code, data)
            if reply is not None:
                for after_s, part in self.mangle(reply):
                    self.put(part, self.turnaround_s + after_s)

    def _check(self):
        if self.gone is not None:
            raise self.gone
