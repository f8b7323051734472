"""Fuzz target: the JR3 codec on CAN. No input may raise or grow memory."""

from __future__ import annotations

from palpate.drivers.can import CanFrame, FrameKind
from palpate.drivers.jr3.codec import CanDecoder, Reassembly
from palpate.drivers.jr3.messages import Ack, Forces, FullScales, Moments, Reading, Scaling
from palpate.drivers.jr3.sampling import FrameCounter
from tests.support.fuzzing import require

PERIOD_US = 10_000
_KINDS = tuple(FrameKind)
_SCALING = Scaling(FullScales((115, 111, 185), (56, 52, 61)))


def check_messages(messages):
    """What every message promises, whatever it was made of."""
    counter, last = FrameCounter(PERIOD_US), 0
    for message in messages:
        if isinstance(message, Reading):
            require(0 <= message.counter <= 0xFFFF, "counter of 16 bits")
            sequence = counter.accept(message.counter)
            require(sequence is None or sequence > last, "the sequence increases")
            last = last if sequence is None else sequence
            force_N, torque_Nm = _SCALING.wrench(message)
            require(max(map(abs, force_N)) <= 2 * 185 and max(map(abs, torque_Nm)) <= 2 * 6.1, "twice full scale")
        elif isinstance(message, Ack):
            require(len(message.scales) in (0, 3, 6), "length of full scales")


def once(data):
    """Frames of 3 bytes (kind and length, identifier) and a payload, through decoder and joiner."""
    decoder, joiner = CanDecoder(1), Reassembly()
    messages = []
    frames, at = 0, 0
    while at + 3 <= len(data):
        size = data[at] & 0x0F
        can_id = int.from_bytes(data[at + 1 : at + 3], "big")
        frame = CanFrame(can_id, data[at + 3 : at + 3 + size], _KINDS[(data[at] >> 4) % len(_KINDS)])
        at += 3 + size
        frames += 1
        message = decoder.decode(frame)
        whole = joiner.add(message) if isinstance(message, Forces | Moments) else message
        if whole is not None:
            messages.append(whole)
    seen = decoder.counts
    counted = seen.good + seen.foreign + seen.garbage
    require(counted == frames, "every frame is counted once")
    check_messages(messages)
    return messages
