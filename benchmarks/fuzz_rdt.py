"""Fuzzing of the Net F/T driver with arbitrary messages from the box and the network.

    python -m benchmarks.fuzz_rdt --seconds 600
    python -m benchmarks.fuzz_rdt --seconds 5 --first-seed 7

Each seed generates records of a stream that are lost, repeated, reordered, truncated, joined and corrupted, with any
status and counters; settings pages with missing, duplicate and corrupt fields; and requests to the emulated box. Only a
``DriverError`` may be raised, every record must be accounted for, and sample numbers must increase without duplicates.
The first finding ends the run and prints its seed.
"""

from __future__ import annotations

import random
import struct
from collections import Counter
from itertools import pairwise
from math import isfinite

from benchmarks.fuzzing import drawn, require
from palpate.drivers.ati import NetFt, NetFtBox, parse_box
from palpate.drivers.ati.codec import faults_in
from palpate.drivers.errors import DriverError
from palpate.simulation.emulators.ati import EmulatedBox

BOX = NetFtBox(1e6, 1e6, (330.0,) * 3, (30.0,) * 3, 1000.0)
RECORD = struct.Struct(">IIIiiiiii")
WORDS = (0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)


class Network:
    """A link that delivers the generated datagrams."""

    def __init__(self) -> None:
        self.waiting: list[bytes] = []
        self.is_gone = False

    def send(self, datagram: bytes) -> None:
        require(len(datagram) == 8, "a request has eight bytes")
        self._look()

    def receive(self) -> list[bytes]:
        self._look()
        waiting, self.waiting = self.waiting, []
        return waiting

    def _look(self) -> None:
        if self.is_gone:
            raise OSError("gone")


def stream(draw: random.Random) -> None:
    """Stream from a box through an unreliable network."""
    wire = Network()
    device = NetFt(wire, BOX)
    now_ns = 0
    device.start(now_ns)
    number = draw.choice([0, 1, 2**32 - 20, draw.randrange(2**32)])
    sample, taken, records, malformed = draw.randrange(2**32), [], 0, 0
    kept: list[bytes] = []
    for _ in range(draw.randrange(1, 60)):
        now_ns += draw.choice([0, 1_000_000, 7_000_000, 200_000_000])
        for _ in range(draw.randrange(4)):
            number = (number + draw.choice([1, 1, 1, 1, 2, 5, 2000, 2**31, 0, -1])) % 2**32
            sample = (sample + draw.choice([1, 1, 7, 0])) % 2**32
            status = draw.choice([0, 0, 0, 0, 1 << 17, draw.randrange(2**32)])
            counts = [draw.randrange(-(2**31), 2**31) for _ in range(6)]
            kept.append(RECORD.pack(number, sample, status, *counts))
        datagrams = [
            b"".join(draw.choices(kept[-8:], k=draw.choice([1, 1, 1, 2, 40]))) for _ in range(draw.randrange(4)) if kept
        ]
        draw.shuffle(datagrams)
        if datagrams and draw.random() < 0.2:
            spoilt = bytearray(datagrams[0])
            spoilt[draw.randrange(len(spoilt))] ^= 1 << draw.randrange(8)
            datagrams[0] = draw.choice([bytes(spoilt), bytes(spoilt)[: draw.randrange(len(spoilt))], b""])
        for datagram in datagrams:
            fits = len(datagram) % 36 == 0 and len(datagram) > 0
            records, malformed = records + (len(datagram) // 36 if fits else 0), malformed + (not fits)
        wire.waiting += datagrams
        wire.is_gone = draw.random() < 0.02
        if wire.is_gone:
            wire.waiting = []
            records -= sum(len(datagram) // 36 for datagram in datagrams if datagram and len(datagram) % 36 == 0)
            malformed -= sum(not datagram or len(datagram) % 36 != 0 for datagram in datagrams)
        taken += device.poll(now_ns)
        try:
            device.check()
        except DriverError:
            if draw.random() < 0.5:
                device.acknowledge()
    found = device.errors
    require(device.received == len(taken), "samples are counted")
    require(found["malformed datagrams"] == malformed, "malformed datagrams are counted")
    accounted = device.received + found["old records"]
    require(accounted == records, f"every record is accounted for: {accounted} of {records}")
    require(all(a.sequence < b.sequence for a, b in pairwise(taken)), "numbered upwards")
    require(all(map(isfinite, (x for s in taken for x in (*s.force_N, *s.torque_Nm)))), "finite")
    require(found["lost records"] >= 0, "no less than nothing is lost")


def page(draw: random.Random, seen: Counter[str]) -> None:
    """Parse a corrupted settings page."""
    text = bytearray(EmulatedBox(lambda now_ns: (0.0,) * 6).page())
    for _ in range(draw.randrange(5)):
        at = draw.randrange(len(text))
        piece = draw.choice(
            [b"", b"nan", b"1e400", b"-1", b";", b"<", b"\xff", draw.randbytes(4), bytes(text[at : at + 40])]
        )
        text[at : at + draw.choice([0, 1, 5, 60])] = piece
    try:
        box = parse_box(bytes(text))
    except DriverError:
        seen["pages refused"] += 1
        return
    numbers = (box.counts_per_N, box.counts_per_Nm, box.rate_Hz, *box.range_N, *box.range_Nm)
    require(all(isfinite(x) and x > 0.0 for x in numbers), "an accepted page has numbers above 0")
    seen["pages accepted"] += 1


def box(draw: random.Random) -> None:
    """Send requests to the emulated box, and check the records that it streams."""
    emulated = EmulatedBox(lambda now_ns: (1e9, -1e9, 0.0, 1e-9, float(now_ns % 7), -30.0))
    now_ns = 0
    for _ in range(draw.randrange(1, 12)):
        request = struct.pack(
            ">HHI", draw.choice([0x1234, 0x1234, 0]), draw.choice([0, 2, 3, 0x42, 9]), draw.choice([0, 1, 3, 7])
        )
        emulated.receive(draw.choice([request, request, request[:5], draw.randbytes(8)]), now_ns)
        emulated.status = draw.choice([0, *WORDS])
        now_ns += draw.choice([1_000_000, 9_000_000])
        for datagram in emulated.step(now_ns):
            require(len(datagram) == RECORD.size, "a datagram is a record")
            require(isinstance(faults_in(RECORD.unpack(datagram)[2]), tuple), "status words have names")


def main() -> None:
    seen: Counter[str] = Counter()

    def one(seed: int) -> None:
        draw = random.Random(seed)
        stream(draw)
        page(draw, seen)
        box(draw)

    drawn(__doc__, "cases", one, seen)


if __name__ == "__main__":
    main()
