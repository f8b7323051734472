"""Faults on an emulated serial line, drawn from a seeded generator and switchable while it runs."""

from collections import Counter
from dataclasses import dataclass
from typing import Annotated, Final, TypeAlias

import numpy as np

from palpate.core.ports import Range, Settings

_NS: Final = 1_000_000_000
_LONGEST_BYTE: Final = 12  # a slow byte covers no more fast ones than 230400 baud has in one of 19200
_Probability: TypeAlias = Annotated[float, Range(0.0, 1.0)]


@dataclass(frozen=True, slots=True)
class SerialFaults(Settings):
    """What goes wrong between host and device, and with which probability."""

    drop_command_byte: _Probability = 0.0
    """A byte from the host is lost."""
    corrupt_command_byte: _Probability = 0.0
    """One of its bits flips."""
    drop_byte: _Probability = 0.0
    """A byte to the host is lost."""
    corrupt_byte: _Probability = 0.0
    """One of its bits flips."""
    duplicate_byte: _Probability = 0.0
    """It arrives twice."""
    drop_reply: _Probability = 0.0
    """A whole reply is lost."""
    duplicate_reply: _Probability = 0.0
    """It arrives twice."""
    delay_reply: _Probability = 0.0
    """It comes late by `delay_s`."""
    wrong_checksum: _Probability = 0.0
    """Its last byte is wrong, whatever the protocol uses that for."""
    delay_s: Annotated[float, Range(0.0)] = 0.05
    """Length of a delay."""
    silent: bool = False
    """The device receives and acts but sends nothing at all."""


NO_FAULTS: Final = SerialFaults()


@dataclass(frozen=True, slots=True)
class Delivery:
    """Bytes on their way to the host."""

    data: bytes
    delay_ns: int = 0


class FaultInjector:
    """Applies `SerialFaults` to commands and replies.

    Setting `faults` replaces all of them at once, so another thread may do it at any time.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self.faults = NO_FAULTS
        self.injected: Counter[str] = Counter()
        self._rng = rng

    def on_command(self, data: bytes) -> bytes:
        """What arrives of bytes that the host has sent."""
        faults = self.faults
        if not (faults.drop_command_byte or faults.corrupt_command_byte):
            return data
        arrived = bytearray()
        for byte in data:
            if not self._strikes("drop_command_byte", faults.drop_command_byte):
                flip = self._strikes("corrupt_command_byte", faults.corrupt_command_byte)
                arrived.append(self._flipped(byte) if flip else byte)
        return bytes(arrived)

    def on_reply(self, reply: bytes) -> list[Delivery]:
        """What arrives of a reply, and when."""
        faults = self.faults
        if faults is NO_FAULTS:
            return [Delivery(reply)]
        if faults.silent:
            self.injected["silent"] += 1
            return []
        if self._strikes("drop_reply", faults.drop_reply):
            return []
        if self._strikes("wrong_checksum", faults.wrong_checksum):
            reply = reply[:-1] + bytes([self._flipped(reply[-1])])
        data = self._with_byte_faults(reply, faults)
        delay_ns = round(faults.delay_s * _NS) if self._strikes("delay_reply", faults.delay_reply) else 0
        copies = 2 if self._strikes("duplicate_reply", faults.duplicate_reply) else 1
        return [Delivery(data, delay_ns)] * copies

    def garbage(self, data: bytes, stretch: float) -> bytes:
        """What a receiver at another line rate makes of bytes: others, and about `stretch` times as many."""
        self.injected["baud_mismatch"] += 1
        return self._rng.bytes(max(1, round(len(data) * min(stretch, _LONGEST_BYTE))))

    def _with_byte_faults(self, reply: bytes, faults: SerialFaults) -> bytes:
        if not (faults.drop_byte or faults.corrupt_byte or faults.duplicate_byte):
            return reply
        sent = bytearray()
        for byte in reply:
            if self._strikes("drop_byte", faults.drop_byte):
                continue
            arrived = self._flipped(byte) if self._strikes("corrupt_byte", faults.corrupt_byte) else byte
            sent.append(arrived)
            if self._strikes("duplicate_byte", faults.duplicate_byte):
                sent.append(arrived)
        return bytes(sent)

    def _strikes(self, name: str, probability: float) -> bool:
        if probability <= 0.0 or self._rng.random() >= probability:
            return False
        self.injected[name] += 1
        return True

    def _flipped(self, byte: int) -> int:
        return byte ^ (1 << int(self._rng.integers(8)))
