"""Samples that come later than they did are told by the device's count; what clocks and a busy computer do is not."""

from collections.abc import Callable, Iterable, Sequence

import pytest

from palpate.adapters.hardware.lateness import LATE_NS, Lateness
from palpate.drivers.device import ForceSample, PolledSensor
from palpate.drivers.errors import SilentError

MS = 1_000_000
SPAN = 1 << 16


class Counted(PolledSensor):
    """A device that counts its samples, one each 125 us."""

    count_Hz = 8000.0
    count_span = SPAN

    def silence(self, now_ns: int) -> SilentError:
        raise NotImplementedError

    def poll(self, now_ns: int) -> Sequence[ForceSample]:
        raise NotImplementedError

    def check(self) -> None:
        raise NotImplementedError


def looked_at(arrives_ns: Callable[[int], int], looks_ns: Iterable[int], restarts_at: int = 1 << 30) -> list[str]:
    """What is told of a sample each ms that arrives then, each with eight times its number as its count."""
    device, lateness, told = Counted(), Lateness(LATE_NS), []
    due = sorted((arrives_ns(number), number) for number in range(1, 4000))
    for now_ns in looks_ns:
        arrived = [number for arrives, number in due if arrives <= now_ns]
        due = due[len(arrived) :]
        if arrived:
            newest = max(arrived)
            device.latest = ForceSample((0.0,) * 3, (0.0,) * 3, newest, now_ns)
            device.count = 8 * (newest if newest < restarts_at else newest - restarts_at) % SPAN
        if (problem := lateness.told(device, now_ns)) is not None:
            told.append(problem)
    return told


def each_tick(begin_ms: int = 0, end_ms: int = 4000) -> range:
    return range(begin_ms * MS, end_ms * MS, 7 * MS)


def late_by(ms: float) -> Callable[[int], int]:
    """From the thousandth on."""
    return lambda number: number * MS + (round(ms * MS) if number > 1000 else 0)


def test_samples_that_come_later_than_they_did_are_told_within_a_tenth_of_a_second() -> None:
    told = looked_at(late_by(30), each_tick(end_ms=1100))
    assert told[0].startswith(("its samples come 29 ms later", "its samples come 30 ms later"))


@pytest.mark.parametrize(
    ("arrives_ns", "looks_ns"),
    [
        (late_by(15), each_tick()),
        (lambda n: n * MS + (30 * MS if 1000 < n < 1015 else 0), each_tick()),
        (lambda n: n * (MS + 5000), each_tick()),  # its clock is half a per cent slow
        (late_by(0), [*each_tick(0, 500), *range(500 * MS, 4000 * MS, 90 * MS)]),  # a computer that is held up
        # After a silence of 400 ms what is made up for comes at once, but not in one piece.
        (lambda n: n * MS if not 600 < n < 1040 else max(n, 1000) * MS + 40 * MS, each_tick()),
    ],
)
def test_what_this_computer_and_clocks_do_is_no_lateness(
    arrives_ns: Callable[[int], int], looks_ns: Iterable[int]
) -> None:
    assert looked_at(arrives_ns, looks_ns) == []


def test_a_device_that_has_restarted_is_not_late() -> None:
    assert looked_at(late_by(0), each_tick(), restarts_at=1500) == []


def test_what_does_not_count_is_not_judged() -> None:
    device = Counted()
    device.latest = ForceSample((0.0,) * 3, (0.0,) * 3, 1, 0)
    assert Lateness(LATE_NS).told(device, 0) is None
    assert Lateness(0).told(device, 0) is None
