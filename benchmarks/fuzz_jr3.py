"""Coverage-guided fuzzing of the JR3 codecs: no input may raise, grow memory, or depend on how it was cut.

python -m benchmarks.fuzz_jr3 --seconds 600 --codec can
python -m benchmarks.fuzz_jr3 --seconds 600 --codec uart --corpus DIR
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.fuzzing import CORPORA, guided, parser_of, require
from palpate.drivers.can import CanFrame, FrameKind
from palpate.drivers.jr3.codec_can import CanDecoder, Reassembly
from palpate.drivers.jr3.codec_uart import MAX_FRAME, UartParser
from palpate.drivers.jr3.messages import Ack, Forces, FullScales, Message, Moments, Reading, Scaling
from palpate.drivers.jr3.sampling import FrameCounter

PERIOD_US = 10_000
_KINDS = tuple(FrameKind)
_SCALING = Scaling(FullScales((115, 111, 185), (56, 52, 61)))


def check_messages(messages: list[Message]) -> None:
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


def can_once(data: bytes) -> list[Message]:
    """Frames of 3 bytes (kind and length, identifier) and a payload, through decoder and joiner."""
    decoder, joiner = CanDecoder(1), Reassembly()
    messages: list[Message] = []
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


def uart_once(data: bytes) -> list[Message]:
    """A byte that says how to cut and what is expected, and a stream, whole and cut."""
    if not data:
        return []
    size, stream = 1 + (data[0] >> 1), data[1:]
    whole, split = UartParser(), UartParser()
    whole.expect_scales = split.expect_scales = bool(data[0] & 1)
    messages = whole.feed(stream)
    heard: list[Message] = []
    for at in range(0, len(stream), size):
        heard += split.feed(stream[at : at + size])
        require(split.pending < MAX_FRAME, "bounded memory")
    require(heard == messages and split.counts == whole.counts, "the same for every chunking")
    check_messages(messages)
    return messages


CODECS: dict[str, Callable[[bytes], list[Message]]] = {"can": can_once, "uart": uart_once}


def target(atheris: Any, arguments: argparse.Namespace) -> tuple[Callable[[bytes], object], Path]:
    for function in (CanDecoder.decode, UartParser.feed, UartParser._frame_size, UartParser._ack_size, Reassembly.add):  # noqa: SLF001
        owner = {"decode": CanDecoder, "add": Reassembly}.get(function.__name__, UartParser)
        setattr(owner, function.__name__, atheris.instrument_func(function))
    FrameCounter.accept = atheris.instrument_func(FrameCounter.accept)  # type: ignore[method-assign]
    return CODECS[arguments.codec], CORPORA / f"jr3_{arguments.codec}"


if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("--codec", choices=sorted(CODECS), required=True)
    guided(parser, target, 256)
