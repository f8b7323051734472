"""The emulated CAN wire: arbitration, frame times, order and faults."""

import numpy as np
import pytest

from palpate.simulation.emulators.lines.can_bus import OUTBOX_FRAMES, BusFaults, BusFrame, EmulatedCanBus, frame_bits

US = 1_000


class Echo:
    """Sends what it is told to, and remembers what it hears."""

    def __init__(self) -> None:
        self.outbox: list[BusFrame] = []
        self.heard: list[BusFrame] = []

    def feed(self, arbitration_id: int, data: bytes, now_ns: int) -> list[BusFrame]:
        self.heard.append(BusFrame(arbitration_id, data))
        return [BusFrame(arbitration_id + 1, data)] if arbitration_id == 0x10 else []

    def advance(self, now_ns: int) -> list[BusFrame]:
        out, self.outbox = self.outbox, []
        return out


def wire_of(*nodes: Echo, seed: int = 3) -> EmulatedCanBus:
    return EmulatedCanBus(nodes, generator=np.random.default_rng(seed))


def test_frame_times() -> None:
    assert frame_bits(8) == 123
    assert 47 <= frame_bits(0) <= 55
    with pytest.raises(ValueError, match="bit_rate_Hz"):
        EmulatedCanBus((), bit_rate_Hz=0, generator=np.random.default_rng(0))


def test_a_frame_arrives_when_its_last_bit_is_over_and_not_at_its_sender() -> None:
    one, two = Echo(), Echo()
    wire = wire_of(one, two)
    frame = BusFrame(0x601, bytes(8))
    one.outbox.append(frame)
    assert wire.advance(0) == []
    assert wire.advance(122 * US) == []
    assert wire.advance(123 * US) == [frame]
    assert (one.heard, two.heard) == ([], [frame])
    assert wire.frames_carried == 1


def test_the_lowest_identifier_wins_but_a_node_keeps_its_order() -> None:
    one, two = Echo(), Echo()
    one.outbox = [BusFrame(0x601, b"1"), BusFrame(0x681, b"1"), BusFrame(0x601, b"2"), BusFrame(0x681, b"2")]
    two.outbox = [BusFrame(0x90, b""), BusFrame(0x650, b"")]
    wire = wire_of(one, two)
    frames = wire.advance(0) + wire.advance(10_000 * US)
    assert [frame.arbitration_id for frame in frames] == [0x90, 0x601, 0x650, 0x681, 0x601, 0x681]


@pytest.mark.parametrize(
    ("faults", "expected"),
    [
        (BusFaults(), 200),
        (BusFaults(drop=0.2), 160),
        (BusFaults(duplicate=0.2), 240),
    ],
)
def test_frames_get_lost_or_doubled(faults: BusFaults, expected: int) -> None:
    node = Echo()
    wire = wire_of(node)
    wire.trouble.faults = faults
    node.outbox = [BusFrame(0x601, bytes(8))] * 200
    wire.advance(0)
    assert len(wire.advance(1_000_000 * US)) == pytest.approx(expected, abs=20 if expected != 200 else 0)


def test_a_corrupt_frame_has_one_wrong_bit() -> None:
    node = Echo()
    wire = wire_of(node)
    wire.trouble.faults = BusFaults(corrupt=1.0)
    node.outbox = [BusFrame(0x601, bytes(8)), BusFrame(0x701, b"")]
    wire.advance(0)
    wrong, empty = wire.advance(1_000 * US)
    assert int.from_bytes(wrong.data, "big").bit_count() == 1
    assert empty == BusFrame(0x701, b"")


def test_a_delayed_frame_waits_and_does_not_hold_up_other_nodes() -> None:
    one, two = Echo(), Echo()
    wire = wire_of(one, two)
    one.outbox = [BusFrame(0x601, b"")]
    wire.trouble.faults = BusFaults(delay=1.0, delay_ns=5_000 * US)
    wire.advance(0)
    wire.trouble.faults = BusFaults()
    two.outbox = [BusFrame(0x602, b"")]
    assert wire.advance(1_000 * US) == []
    assert wire.advance(2_000 * US) == [BusFrame(0x602, b"")]
    assert wire.advance(5_000 * US) == []
    assert wire.advance(5_051 * US) == [BusFrame(0x601, b"")]


def test_faults_are_seeded() -> None:
    def survivors(seed: int) -> list[BusFrame]:
        node = Echo()
        wire = wire_of(node, seed=seed)
        wire.trouble.faults = BusFaults(drop=0.5, corrupt=0.5)
        node.outbox = [BusFrame(0x601, bytes(8))] * 100
        wire.advance(0)
        return wire.advance(1_000_000 * US)

    assert survivors(1) == survivors(1)
    assert survivors(1) != survivors(2)


def test_a_crowded_bus_refuses_frames_instead_of_keeping_them_for_ever() -> None:
    node = Echo()
    wire = wire_of(node)
    node.outbox = [BusFrame(0x601, bytes(8))] * 1000
    wire.advance(0)
    assert len(wire.advance(1_000_000 * US)) == OUTBOX_FRAMES
    assert wire.frames_refused == 1000 - OUTBOX_FRAMES
