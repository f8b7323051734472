"""The emulated CAN wire: arbitration, frame times, order and faults."""

import pytest

from palpate.simulation.emulators.lines.can_bus import OUTBOX_FRAMES, BusFrame, EmulatedCanBus, frame_bits

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
    return EmulatedCanBus(nodes)


def test_frame_times() -> None:
    assert frame_bits(8) == 123
    assert 47 <= frame_bits(0) <= 55
    with pytest.raises(ValueError, match="bit_rate_Hz"):
        EmulatedCanBus((), bit_rate_Hz=0)


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


def test_a_crowded_bus_refuses_frames_instead_of_keeping_them_for_ever() -> None:
    node = Echo()
    wire = wire_of(node)
    node.outbox = [BusFrame(0x601, bytes(8))] * 1000
    wire.advance(0)
    assert len(wire.advance(1_000_000 * US)) == OUTBOX_FRAMES
    assert wire.frames_refused == 1000 - OUTBOX_FRAMES
