"""The conversation: samples, restarts, silence and pulled cables."""

import re

import pytest

from palpate.drivers.can.link import CanFrame
from palpate.drivers.errors import DeviceFaultError, SilentError
from palpate.drivers.jr3 import Jr3Settings
from palpate.drivers.jr3.device import MAX_BOOTS
from palpate.drivers.jr3.phases import Jr3Phase
from tests.unit.drivers.jr3.board import Bench, forces, moments

BOOTUP = CanFrame(0x701)


def test_a_sample() -> None:
    bench = Bench().streaming()
    bench.polls(4, 5.0)
    (sample,) = bench.read(z=-16384, step=78 * 3)
    assert sample.force_N == (0.0, 0.0, -185.0)
    assert sample.torque_Nm == (0.0, 0.0, 0.0)
    assert (sample.counter, sample.receive_time_ns) == (78 * 4, bench.now_ns)
    assert sample == bench.device.latest
    assert not any((sample.over_range, sample.near_saturated, sample.saturated, sample.after_boot))


def test_bootup_in_mid_run_starts_anew_and_is_told() -> None:
    bench = Bench().streaming()
    last = bench.device.latest
    bench.link.asked.clear()
    bench.link.inbox.append(BOOTUP)
    bench.poll()
    assert bench.device.phase is Jr3Phase.PINGING
    bench.polls(8)
    bench.counter = 0
    (sample,) = bench.read()
    assert bench.link.asked == ["state", "force scales", "moment scales", "stop", "start"]
    assert sample.after_boot
    assert sample.settling
    assert last is not None
    assert sample.sequence == last.sequence + 1
    bench.device.acknowledge()
    (sample,) = bench.read()
    assert not sample.after_boot
    assert bench.device.statistics().boots == 1


def test_bootup_before_the_first_start_is_no_event() -> None:
    bench = Bench()
    bench.link.mute = {"state"}
    bench.device.open()
    bench.polls(100)
    bench.link.inbox.append(BOOTUP)
    bench.link.mute = set()
    bench.polls(9)
    (sample,) = bench.read()
    assert not sample.after_boot


def test_a_board_that_keeps_restarting() -> None:
    bench = Bench().streaming()
    for _ in range(MAX_BOOTS + 1):
        bench.link.inbox.append(BOOTUP)
        bench.polls(2)
    with pytest.raises(DeviceFaultError, match="restarted"):
        bench.device.check()


def test_restarts_with_readings_between_are_borne() -> None:
    bench = Bench().streaming()
    for _ in range(MAX_BOOTS + 1):
        bench.link.inbox.append(BOOTUP)
        bench.polls(8)
        assert len(bench.read()) == 1
    bench.device.check()


def test_no_half_of_a_reading_survives_a_restart() -> None:
    bench = Bench().streaming()
    bench.link.inbox += [forces(156), BOOTUP]
    bench.polls(8)
    bench.link.inbox += [moments(156)]
    assert bench.poll() == []


def test_a_counter_that_goes_back_is_a_restart() -> None:
    bench = Bench().streaming()
    bench.counter = 20_000
    bench.read()
    bench.read()
    bench.counter = 0
    assert bench.read() == []
    (sample,) = bench.read()
    assert sample.settling
    assert bench.device.statistics().restarts == 1


def test_samples_are_settling_after_a_start() -> None:
    bench = Bench(Jr3Settings(cutoff_Hz=2.0, period_us=10_000)).streaming()
    flags = [bench.read()[0].settling for _ in range(60)]
    assert flags[0]
    assert not flags[-1]
    assert flags == sorted(flags, reverse=True)


@pytest.mark.parametrize(
    ("counts", "flags"),
    [(16384, "000"), (16385, "100"), (-16385, "100"), (26215, "110"), (-32752, "111"), (32767, "111")],
)
def test_saturation(counts: int, flags: str) -> None:
    (sample,) = Bench().streaming().read(z=counts)
    assert f"{sample.over_range:d}{sample.near_saturated:d}{sample.saturated:d}" == flags


def test_silence_and_the_end_of_it() -> None:
    bench = Bench().streaming()
    bench.polls(200)
    bench.device.check()
    bench.polls(2)
    assert bench.device.phase is Jr3Phase.SILENT
    with pytest.raises(SilentError, match="no new reading for 202 ms"):
        bench.device.check()
    assert len(bench.read()) == 1
    bench.device.check()
    assert bench.device.phase is Jr3Phase.STREAMING


def test_a_reading_at_the_end_of_the_scale_says_on_which_channel() -> None:
    bench = Bench().streaming()
    bench.read(z=-32752)
    told = "readings at or near the end of the scale (1, the last Fz at 32752 counts)"
    assert bench.device.oddities(bench.now_ns) == told


@pytest.mark.parametrize(("counts", "answers", "zeroed"), [(5, 1, True), (5, 0, False), (100, 1, False)])
def test_a_zero_that_somebody_else_sets_is_noticed_by_the_board_s_answer(
    counts: int, answers: int, zeroed: bool
) -> None:
    bench = Bench().streaming()
    bench.link.inbox += [CanFrame(0x101, b"\x00")] * answers
    bench.read(z=counts)
    assert bench.device.was_zeroed is zeroed
    bench.device.acknowledge()
    bench.read(z=counts)
    assert not bench.device.was_zeroed


@pytest.mark.parametrize(
    ("what", "told"),
    [
        ("silence", "nothing comes; check cable and power"),
        (
            "the same again",
            r"readings again that were there already \(\d+\) came instead; see that the sensor is plugged in",
        ),
        ("halves", r"halves of readings without the other half \(\d+\) came instead; check shield"),
        ("other lengths", r"frames without sense or cut short \(\d+\) came instead; check shield"),
        ("jumps", r"readings whose counter jumped \(\d+, the last by \+\d+\) came instead; see what else talks"),
    ],
)
def test_what_comes_instead_of_readings_is_told_from_the_first_moment(what: str, told: str) -> None:
    bench = Bench().streaming()
    halves = {
        "silence": lambda n: [],
        "the same again": lambda n: [forces(bench.counter), moments(bench.counter)],
        "halves": lambda n: [forces(bench.counter + n)],
        "other lengths": lambda n: [CanFrame(0x601, bytes(5))],
        "jumps": lambda n: [forces(9000 * (n % 5 + 1)), moments(9000 * (n % 5 + 1))],
    }[what]
    for n in range(1, 22):
        bench.link.inbox += halves(n)
        bench.poll(10.0)
        if n == 6:
            assert re.search(f"no new reading for 60 ms: {told}", str(bench.device.silence(bench.now_ns)))
    with pytest.raises(SilentError, match=f"no new reading for 210 ms: {told}"):
        bench.device.check()


def test_a_counter_that_goes_back_is_told_for_a_second() -> None:
    bench = Bench().streaming()
    assert bench.device.oddities(bench.now_ns) == ""
    bench.counter = 60_000
    bench.read()
    bench.read()
    told = "readings whose counter jumped (1, the last by -5536), counters that began anew (1)"
    assert bench.device.oddities(bench.now_ns) == told
    bench.polls(11, 100.0)
    assert bench.device.oddities(bench.now_ns) == ""


def test_cable_pulled_and_plugged() -> None:
    bench = Bench().streaming()
    bench.link.broken = True
    assert bench.poll() == []
    assert bench.device.phase is Jr3Phase.FAULTED
    with pytest.raises(SilentError, match="cable pulled"):
        bench.device.check()
    bench.link.broken = False
    bench.device.open()
    bench.polls(8)
    bench.read()
    bench.device.check()
