"""The conversation with a Net F/T, advanced by polling: it asks for the stream, and puts what comes in order."""

from dataclasses import dataclass
from typing import Final

from typing_extensions import override

from palpate.drivers.ati.box import NetFtBox
from palpate.drivers.ati.rdt import (
    SATURATED,
    RdtCommand,
    RdtRecord,
    decode_records,
    encode_request,
    faults_in,
    is_turned,
)
from palpate.drivers.ati.wire import UdpWire
from palpate.drivers.device import ForceSample, PolledSensor, listed
from palpate.drivers.errors import DeviceFaultError, DriverError, SilentError

_NAME: Final = "ATI Net F/T"
_ASK_AGAIN_NS: Final = 100_000_000
"""A datagram may be lost, so a stream that does not begin is asked for again."""
_STALL_NS: Final = 100_000_000
_WINDOW: Final = 1024
"""So many records back a late one is told from one that was there already."""
_WRAP: Final = 1 << 32
_OLD, _LATE, _SAME, _TURNED, _SENSELESS, _LOST = (
    "records no newer than one before", "records that came late", "records with the sample of before",
    "records in the other byte order", "datagrams that are no records", "records lost",
)  # fmt: skip
_RESTARTED: Final = "where it has restarted, acknowledge that"
_REMEDIES: Final = {
    _OLD: _RESTARTED,
    _LATE: _RESTARTED,
    _SAME: "power the box again; its sampling has stopped",
    _TURNED: "see what stands between the box and this computer, and turns its bytes",
    _SENSELESS: "see what else sends to this computer, and its network",
    _LOST: "check cable and switch, and the load of the network",
}


@dataclass(slots=True)
class RdtStatistics:
    """Records of the stream, by what became of them.

    Attributes:
        lost: Those that never came. late: Those that came after a newer one. repeated: Those that came again.
        unchanged: Those under a new number with the sample of before. turned: Those in the other byte order.
    """

    samples: int = 0
    lost: int = 0
    late: int = 0
    repeated: int = 0
    unchanged: int = 0
    turned: int = 0
    malformed: int = 0


class NetFt(PolledSensor):
    """A box that streams."""

    def __init__(self, wire: UdpWire, box: NetFtBox) -> None:
        super().__init__()
        self.count_Hz = box.sample_Hz
        self.box = box
        self.statistics = RdtStatistics()
        self._wire = wire
        self._newest: int | None = None
        self._missing: set[int] = set()
        self._asked_ns: int | None = None
        self._offset = self._polled_ns = self._heard_ns = 0

    def start(self, now_ns: int) -> None:
        """Ask for the stream; what still waits of another one is dropped."""
        self._newest, self._missing, self._asked_ns = None, set(), now_ns
        try:
            self._wire.receive()
        except DriverError as error:
            self.failure = self.failure or error
        self._ask(RdtCommand.REAL_TIME)

    def stop(self) -> None:
        """Ask the box to stop streaming; whether it has heard nobody knows."""
        self._asked_ns = None
        self._ask(RdtCommand.STOP)

    def check(self) -> None:
        """Raise what is wrong now."""
        if self.failure is not None:
            raise self.failure
        if self._newest is not None and self._polled_ns - self._heard_ns > _STALL_NS:
            raise self.silence(self._polled_ns)

    @override
    def silence(self, now_ns: int) -> SilentError:
        came, ms = self._account.since(self._heard_ns), (now_ns - self._heard_ns) * 1e-6
        if not came:
            remedy = "check its power and cable, and that no other program has its stream"
            return SilentError(_NAME, f"has sent nothing for {ms:.0f} ms", remedy)
        remedy = next(remedy for name, remedy in _REMEDIES.items() if name in came)
        return SilentError(_NAME, f"has sent nothing new for {ms:.0f} ms, but {listed(came)}", remedy)

    @override
    def poll(self, now_ns: int) -> list[ForceSample]:
        if self._asked_ns is not None and self._newest is None and now_ns - self._asked_ns >= _ASK_AGAIN_NS:
            self._asked_ns = now_ns
            self._ask(RdtCommand.REAL_TIME)
        samples: list[ForceSample] = []
        self._polled_ns = now_ns
        try:
            for datagram in self._wire.receive():
                records = decode_records(datagram)
                self.statistics.malformed += not records
                samples += [self._sample(record, now_ns) for record in records if self._is_news(record)]
        except DriverError as error:
            self.failure = self.failure or error
        if samples:
            self.latest, self._heard_ns = samples[-1], now_ns
            self.statistics.samples += len(samples)
        self._count(now_ns)
        return samples

    def _count(self, now_ns: int) -> None:
        seen = self.statistics
        # Of those that come late none is lost any more.
        counts = (seen.repeated, seen.late, seen.unchanged, seen.turned, seen.malformed, seen.lost + seen.late)
        self._account.note(now_ns, dict(zip(_REMEDIES, counts, strict=True)))

    def _ask(self, command: RdtCommand) -> None:
        try:
            self._wire.send(encode_request(command))
        except DriverError as error:
            self.failure = self.failure or error

    def _is_news(self, record: RdtRecord) -> bool:
        """Whether it is newer than all before; the others are counted."""
        counts, newest = self.statistics, self._newest
        if is_turned(record, newest):
            counts.turned += 1
            return False
        if newest is None:
            self._newest = record.rdt_sequence
            # Numbers of samples go on where an earlier stream ended.
            self._offset = (0 if self.latest is None else self.latest.sequence + 1) - record.rdt_sequence
        else:
            step = (record.rdt_sequence - newest + _WRAP // 2) % _WRAP - _WRAP // 2
            number = newest + step
            age = (record.ft_sequence - (self.count or 0)) % _WRAP
            if step <= 0 and 0 < age < _WRAP // 2:
                # A younger sample under an older number: what was first of this stream was the last of another.
                self._newest, self._missing = record.rdt_sequence, set()
                self._offset += newest + 1 - record.rdt_sequence
            elif step <= 0:
                is_late = number in self._missing
                self._missing.discard(number)
                counts.late, counts.lost = counts.late + is_late, counts.lost - is_late
                counts.repeated += not is_late
                return False
            else:
                self._newest = number
                counts.lost += step - 1
                self._missing = {n for n in self._missing if n > number - _WINDOW}
                self._missing |= set(range(max(newest + 1, number - _WINDOW + 1), number))
        if record.ft_sequence == self.count:
            counts.unchanged += 1
            return False
        self.count = record.ft_sequence
        return True

    def _sample(self, record: RdtRecord, now_ns: int) -> ForceSample:
        faults = faults_in(record.status)
        if faults and self.failure is None:
            remedy = "look at the box's page System Information, then acknowledge"
            self.failure = DeviceFaultError(_NAME, f"it reports {'; '.join(faults)}", remedy)
        x, y, z, tx, ty, tz = record.counts
        box = self.box
        force = x / box.counts_per_N, y / box.counts_per_N, z / box.counts_per_N
        torque = tx / box.counts_per_Nm, ty / box.counts_per_Nm, tz / box.counts_per_Nm
        rated = zip((*force, *torque), (*box.range_N, *box.range_Nm), strict=True)
        beyond = any(abs(value) > most for value, most in rated)
        number = self._offset + (self._newest or 0)
        return ForceSample(force, torque, number, now_ns, over_range=beyond, saturated=bool(record.status & SATURATED))
