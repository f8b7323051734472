"""Fuzz target: the JR3 codec on CAN. No input may raise or grow memory."""

from collections import Counter

from benchmarks.fuzzing import require
from palpate.drivers.can import CanFrame
from palpate.drivers.jr3 import LEFT_HANDED
from palpate.drivers.jr3.codec import CanDecoder
from palpate.drivers.jr3.messages import Ack, FullScales, Reading
from palpate.drivers.jr3.sampling import Sampler


def check_messages(messages):
    """What every message promises, whatever it was made of."""
    sampler, last = Sampler(5000, LEFT_HANDED, Counter()), 0
    sampler.full_scales = FullScales((115, 111, 185), (56, 52, 61))
    for message in messages:
        if isinstance(message, Reading):
            require(0 <= message.counter <= 0xFFFF, "counter of 16 bits")
            sample = sampler.take(message, 0)
            if sample is not None:
                require(sample.sequence > last, "the sequence increases")
                last = sample.sequence
                require(max(map(abs, sample.force_N)) <= 2 * 185, "twice full scale")
                require(max(map(abs, sample.torque_Nm)) <= 2 * 6.1, "twice full scale")
        elif isinstance(message, Ack):
            require(len(message.scales) in (0, 3), "length of full scales")


def once(data):
    """Frames of 3 bytes (length, identifier) and a payload, through the decoder."""
    decoder, messages, at = CanDecoder(1, Counter()), [], 0
    while at + 3 <= len(data):
        size = data[at] & 0x0F
        can_id = int.from_bytes(data[at + 1 : at + 3], "big")
        message = decoder.decode(CanFrame(can_id & 0x7FF, data[at + 3 : at + 3 + size]))
        at += 3 + size
        if message is not None:
            messages.append(message)
    check_messages(messages)
    return messages
