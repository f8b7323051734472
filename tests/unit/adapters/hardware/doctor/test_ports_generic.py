"""Times, wrenches and devices of which only the ports are known."""

import pytest

from palpate.adapters.hardware.doctor.findings import Level, Notebook
from palpate.adapters.hardware.doctor.pace import at_rate, distances, examine_clock, rate_Hz, spread_of
from palpate.adapters.hardware.doctor.ports import WrenchReading, examine_encoder, examine_force_sensor, examine_wrench
from palpate.core.ports.contracts import FakeClock
from tests.fake_devices import FakeForceSensor, FakeJointEncoder
from tests.unit.adapters.hardware.doctor.notebook import facts, told

MS = 1_000_000


class LateClock(FakeClock):
    """Wakes late, or too early."""

    def __init__(self, late_ns: int) -> None:
        super().__init__()
        self._late_ns = late_ns

    def sleep_until(self, deadline_ns: int) -> None:
        super().sleep_until(deadline_ns + self._late_ns)


@pytest.fixture
def notes() -> Notebook:
    return Notebook("device")


def test_rates_and_distances() -> None:
    times = [0, 5 * MS, 10 * MS, 20 * MS]
    assert rate_Hz(times) == pytest.approx(150.0)
    assert rate_Hz([3]) == 0.0
    spread = spread_of(distances(times))
    assert spread is not None
    assert (spread.min_ms, spread.median_ms, spread.max_ms) == (5.0, 5.0, 10.0)
    assert spread_of([]) is None


def test_turns_that_are_missed_are_left_out() -> None:
    clock, late_ns = FakeClock(), list[int]()
    begun: list[int] = []

    def act() -> None:
        begun.append(clock.now_ns())
        clock.sleep_until(clock.now_ns() + (25 * MS if len(begun) == 2 else MS))

    at_rate(clock, 100.0, 0.1, act, late_ns)
    assert begun == [n * 10 * MS for n in (0, 1, 4, 5, 6, 7, 8, 9)]
    assert set(late_ns) == {0}


@pytest.mark.parametrize(("late_ns", "level"), [(0, Level.OK), (5 * MS, Level.NOTE), (-MS, Level.WRONG)])
def test_the_clock(notes: Notebook, late_ns: int, level: Level) -> None:
    examine_clock(LateClock(late_ns), notes)
    assert [finding.level for finding in notes.section().findings] == [level]


def readings(values: list[float], *, near: bool = False) -> list[WrenchReading]:
    return [WrenchReading((0.0, 0.0, v), (0.0, 0.0, 0.0), i, near) for i, v in enumerate(values)]


def test_noise_and_offset_of_each_channel(notes: Notebook) -> None:
    examine_wrench(readings([1.0, 1.2] * 5), notes, (100.0,) * 6)
    assert not told(notes, Level.WRONG)
    (table,) = notes.section().tables
    assert table.rows[2] == ("Fz", "+1.100 N", "0.1000 N", "1.200 N", "100 N", "1%")


@pytest.mark.parametrize(
    ("values", "near", "level", "words"),
    [
        ([1.0], False, Level.WRONG, "only 1 readings"),
        ([1.0, 1.0], False, Level.WRONG, "dead"),
        ([1.0, 1.2], True, Level.WRONG, "saturation"),
        ([0.0, 9.0], False, Level.NOTE, "wanders"),
        ([0.01, -0.01], False, Level.NOTE, "all offsets are zero"),
    ],
)
def test_what_is_wrong_with_readings(
    notes: Notebook, values: list[float], near: bool, level: Level, words: str
) -> None:
    examine_wrench(readings(values, near=near), notes, resolution=0.02)
    assert words in " ".join(told(notes, level))


def sensor(clock: FakeClock) -> FakeForceSensor:
    made = FakeForceSensor(clock)
    made.configure()
    made.activate()
    return made


def test_a_strange_force_sensor(notes: Notebook) -> None:
    clock = FakeClock()
    examine_force_sensor(sensor(clock), clock, 0.2, notes)
    assert "1000.0 Hz" in facts(notes)["samples"]
    assert "dead" in " ".join(told(notes, Level.WRONG))


def test_a_strange_force_sensor_that_falls_silent(notes: Notebook) -> None:
    clock = FakeClock()
    device = sensor(clock)
    device.read()
    device.silent = True
    examine_force_sensor(device, clock, 0.2, notes)
    assert "stale" in " ".join(told(notes, Level.WRONG))


@pytest.mark.parametrize(
    ("pose", "joints", "words"),
    [((0.0, 0.5), 2, ""), ((0.0, 5.0), 2, "joints 2 are beyond"), ((0.0, 0.5), 3, "the kinematic model has 3")],
)
def test_strange_encoders(notes: Notebook, pose: tuple[float, ...], joints: int, words: str) -> None:
    clock = FakeClock()
    encoder = FakeJointEncoder(clock, lambda: pose)
    encoder.configure()
    encoder.activate()
    examine_encoder(encoder, clock, 0.1, (-1.0,) * joints, (1.0,) * joints, notes)
    wrong = " ".join(told(notes, Level.WRONG))
    assert words in wrong
    assert bool(words) == bool(wrong)
