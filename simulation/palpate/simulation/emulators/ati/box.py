"""The box: takes requests, gives records at its own times; uses neither sockets nor a clock."""

from collections.abc import Callable
from dataclasses import dataclass

_NS = 1_000_000_000
_MAGIC = b"\x12\x34"
_STOP, _REAL_TIME, _BUFFERED, _BIAS = 0, 2, 3, 0x42
_INTERNAL_HZ = 7000


@dataclass(frozen=True)
class EmulatedBoxConfig:
    """How the box is set.

    Attributes:
        rate_Hz: Records a second, at most 7000.
        ratings: Rated range of the six axes, in these units.
    """

    rate_Hz: int = 1000
    counts_per_force: int = 1_000_000
    counts_per_torque: int = 1_000_000
    force_unit: str = "N"
    torque_unit: str = "Nm"
    ratings: tuple[float, ...] = (330.0, 330.0, 990.0, 30.0, 30.0, 30.0)
    rdt: bool = True
    buffered_records: int = 5


def _honest(datagrams: list[bytes]) -> list[bytes]:
    return datagrams


class EmulatedBox:
    """A Net F/T box with a transducer.

    Args:
        wrench: Force and torque on the transducer at a time in ns, (6,), in the box's units.

    Attributes:
        silent: Set it to have nothing sent.
        network: What becomes of datagrams on their way; set it to lose, repeat or reorder some.
    """

    def __init__(self, wrench: Callable[[int], tuple[float, ...]], config: EmulatedBoxConfig | None = None) -> None:
        self.config = EmulatedBoxConfig() if config is None else config
        self.status = 0
        self.silent = False
        self.network: Callable[[list[bytes]], list[bytes]] = _honest
        self.streams = False
        self._wrench = wrench
        self._bias = [0.0] * 6
        self._begin_ns = self._sent = self._wanted = 0
        self._together = 1

    def receive(self, request: bytes, now_ns: int) -> None:
        """Do what a request says; what is no request is passed over, as the box does."""
        if len(request) != 8 or request[:2] != _MAGIC:
            return
        command, count = int.from_bytes(request[2:4], "big"), int.from_bytes(request[4:], "big")
        if command == _STOP:
            self.streams = False
        elif command in (_REAL_TIME, _BUFFERED):
            self.streams, self._begin_ns, self._sent, self._wanted = True, now_ns, 0, count
            self._together = self.config.buffered_records if command == _BUFFERED else 1
        elif command == _BIAS:
            self._bias = list(self._wrench(now_ns))

    def next_event_ns(self) -> int:
        """When the next datagram is due; far off when there is none."""
        if not self.streams:
            return 1 << 62
        return self._begin_ns + (self._sent + self._together) * _NS // self.config.rate_Hz

    def step(self, now_ns: int) -> list[bytes]:
        """The datagrams that are due."""
        datagrams = []
        while self.streams and self.next_event_ns() <= now_ns:
            datagrams.append(b"".join(self._record() for _ in range(self._together)))
            self.streams = not self._wanted or self._sent < self._wanted
        return [] if self.silent else self.network(datagrams)

    def page(self) -> bytes:
        """The page of its settings, ``/netftapi2.xml``."""
        config = self.config
        fields = {
            "runstat": f"0x{self.status:08X}", "runrate": _INTERNAL_HZ, "cfgcalsn": "FT00000",
            "scfgfu": config.force_unit, "scfgtu": config.torque_unit,
            "cfgcpf": config.counts_per_force, "cfgcpt": config.counts_per_torque,
            "cfgmr": ";".join(f"{rating:g}" for rating in config.ratings),
            "setcfgsel": 0, "setbias": ";".join(f"{1e3 * bias:.0f}" for bias in self._bias),
            "comrdte": "Enabled" if config.rdt else "Disabled", "comrdtrate": config.rate_Hz, "mfgdigver": "2.2.59",
        }  # fmt: skip
        told = "".join(f"<{name}>{value}</{name}>\n" for name, value in fields.items())
        return f'<?xml version="1.0"?><netft>\n{told}</netft>\n'.encode()

    def _record(self) -> bytes:
        self._sent += 1
        config, time_ns = self.config, self._begin_ns + self._sent * _NS // self.config.rate_Hz
        scales = [config.counts_per_force] * 3 + [config.counts_per_torque] * 3
        load = zip(self._wrench(time_ns), self._bias, scales, strict=True)
        counts = [max(-(1 << 31), min(round((value - bias) * scale), (1 << 31) - 1)) for value, bias, scale in load]
        words = (self._sent % (1 << 32), time_ns * _INTERNAL_HZ // _NS % (1 << 32), self.status)
        return b"".join(word.to_bytes(4, "big") for word in words) + b"".join(
            count.to_bytes(4, "big", signed=True) for count in counts
        )
