"""The bus budget against figures calculated by hand."""

import pytest

from palpate.drivers.errors import SettingError
from palpate.drivers.nmc import NOP, StatusItem, StopControl, TrajectoryControl, load_traj, stop_motor
from palpate.drivers.nmc.settings import BAUD_DIVISORS, BusSettings, SerialTiming, exchange_size_bytes, same_for_all

POS_VEL = StatusItem.POSITION | StatusItem.VELOCITY
POLL = exchange_size_bytes(NOP, POS_VEL)
TO_POSITION = load_traj(TrajectoryControl.SERVO | TrajectoryControl.START_NOW, position_counts=0)
TO_ALL = load_traj(
    TrajectoryControl.SERVO | TrajectoryControl.START_NOW, position_counts=0, velocity_word=0, acceleration_word=0
)


def cycle(baud, *sizes, latency_s=0.0, reserve=0.0):
    return same_for_all(SerialTiming(baud, latency_s), 6, sizes, reserve)


def test_exchange_sizes():
    assert POLL == 12
    assert exchange_size_bytes(TO_ALL, POS_VEL) == 17 + 8
    assert exchange_size_bytes(TO_POSITION, StatusItem.POSITION) == 9 + 6
    assert exchange_size_bytes(TO_POSITION, POS_VEL) == 17
    assert exchange_size_bytes(stop_motor(StopControl.AMP_ENABLE | StopControl.HERE, 0), StatusItem.POSITION) == 9 + 6


@pytest.mark.parametrize(
    ("baud", "sizes", "cycle_ms", "rate_Hz"),
    [
        (19_200, (POLL,), 37.5, 26.7),
        (57_600, (POLL,), 12.5, 80.0),
        (115_200, (POLL,), 6.25, 160.0),
        (115_200, (POLL, 25), 19.27, 51.9),
        (115_200, (15,), 7.8125, 128.0),
        (230_400, (15,), 3.906, 256.0),
        (115_200, (17,), 8.854, 113.0),
        (230_400, (17,), 4.427, 226.0),
    ],
)
def test_cycle_times(baud, sizes, cycle_ms, rate_Hz):
    budget = cycle(baud, *sizes)
    assert budget.cycle_s * 1e3 == pytest.approx(cycle_ms, rel=1e-3)
    assert budget.max_rate_Hz == pytest.approx(rate_Hz, rel=3e-3)


def test_streaming_at_140_hz_needs_230400_baud():
    cycle(230_400, 15).require(140, 1)
    with pytest.raises(SettingError) as caught:
        cycle(115_200, 15, reserve=0.1).require(140, 1)
    message = str(caught.value)
    for part in ("140 Hz", "90 bytes", "115200 baud", "7.81 ms", "115.2 Hz", "70, 46.67, 35, 28"):
        assert part in message
    with pytest.raises(SettingError, match="none"):
        cycle(19_200, POLL, latency_s=1.0).require(140, 1)
    with pytest.raises(SettingError):
        cycle(230_400, 15).require(140, 0)


def test_documented_divisors():
    assert [BAUD_DIVISORS[baud] for baud in (19_200, 57_600, 115_200, 230_400)] == [63, 20, 10, 5]
    error = {baud: 1.25e6 / (divisor + 1) / baud - 1 for baud, divisor in BAUD_DIVISORS.items()}
    assert max(abs(error[baud]) for baud in (19_200, 57_600, 115_200)) < 0.035
    assert error[230_400] == pytest.approx(-0.096, abs=0.001)
    assert error[250_000] == 0.0


@pytest.mark.parametrize(
    "wrong",
    [
        {"baud": 9600},
        {"adapter_latency_s": -1.0},
        {"slack_s": float("nan")},
        {"errors_in_a_row": 0},
        {"max_modules": 128},
    ],
)
def test_settings_that_cannot_work(wrong):
    with pytest.raises(SettingError):
        BusSettings(**wrong)
