"""A dead sensor that shows noise, a recording, and a wrong scale: none of them passes for a live sensor."""

import numpy as np
import pytest

from palpate.core.ports.rig import SensorFacts
from palpate.core.supervision import SupervisionConfig
from palpate.core.trial import TripReason
from tests.unit.core.supervision.bench import FREE, TOUCHING, UNTARED, Bench

NOISE = np.array([0.1] * 3 + [0.004] * 3)


def live(seed=0, scale=1.0):
    """What a live sensor shows beyond its bias, sample by sample."""
    rng = np.random.default_rng(seed)
    while True:
        yield scale * NOISE * rng.standard_normal(6)


def tick(bench, shown, **more):
    bench.tick(force_N=tuple(shown[:3]), torque_Nm=tuple(shown[3:]), **more)


def clean(bench, readings, ticks, **more):
    """So many ticks without a trip; the last reading."""
    for _ in range(ticks):
        shown = next(readings)
        tick(bench, shown, **more)
        assert bench.supervisor.trip is None
    return shown


def ticks_to_trip(bench, readings, most=200, **more):
    for number in range(1, most + 1):
        tick(bench, next(readings), **more)
        if bench.supervisor.trip is not None:
            return number
    raise AssertionError(f"no trip within {most} ticks")


def tared(config=None, scale=1.0):
    """A sensor of this share of its noise that was tared."""
    bench, readings = Bench(config, noisy=True), live(scale=scale)
    clean(bench, readings, 40, constraints=UNTARED)
    clean(bench, readings, 30)
    return bench, readings


@pytest.mark.parametrize("constraints", [UNTARED, FREE, TOUCHING])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.06])
def test_sensor_that_died_with_some_noise_trips_within_a_seventh_of_a_second(constraints, share):
    bench, readings = (Bench(noisy=True), live()) if constraints is UNTARED else tared()
    last = clean(bench, readings, 100, constraints=constraints)
    dead = (last + noise for noise in live(1, share))
    assert ticks_to_trip(bench, dead, constraints=constraints) <= 21
    reason = TripReason.CHANNEL_FLAT if share else TripReason.SAMPLE_FROZEN
    assert (bench.tripped.reason, bench.tripped.sample) == (reason, "force")


@pytest.mark.parametrize("channel", range(6))
def test_one_frozen_channel_trips(channel):
    bench, readings = tared()
    held = clean(bench, readings, 50)[channel]

    def frozen():
        for shown in readings:
            shown[channel] = held
            yield shown

    assert ticks_to_trip(bench, frozen()) <= 20
    trip = bench.tripped
    assert trip.text.startswith(("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")[channel])


@pytest.mark.parametrize("gain", [1.0, 0.5, -0.3])
def test_recording_trips_whatever_its_length_and_gain(gain):
    bench, readings = tared()
    clean(bench, readings, 300)
    stretch = [clean(bench, readings, 1) for _ in range(100)]
    assert ticks_to_trip(bench, (gain * shown for shown in stretch)) <= 9
    trip = bench.tripped
    assert (trip.reason, trip.sample) == (TripReason.SAMPLES_RECUR, "force")
    assert trip.text == "6 consecutive new force samples repeat earlier ones, 100 samples ago; limit 5"


@pytest.mark.parametrize(("scale", "trips"), [(1.0, False), (1.4, False), (2.0, True), (10.0, True), (100.0, True)])
def test_scale_shows_in_the_noise_while_the_sensor_is_tared(scale, trips):
    readings = live(2, scale)
    weak = {"max_force_N": 200.0, "max_torque_Nm": 10.0, "max_force_rate_N_s": 1e5}
    config = SupervisionConfig(**weak, weakened=tuple(weak))
    bench = Bench(config, noisy=True)
    clean(bench, readings, 40, constraints=UNTARED)
    tick(bench, next(readings))
    assert (bench.supervisor.trip is not None) is trips
    if bench.supervisor.trip is not None:
        assert (bench.tripped.reason, bench.tripped.sample) == (TripReason.SENSOR_NOISE, "force")


def test_slow_sensor_is_not_judged_by_samples_of_the_motion_before():
    bench = Bench(noisy=True)
    for number in range(40):
        shown = (5.0 if number < 20 else 0.5) * NOISE * (-1.0, 1.0)[number % 2] * (1.0 + 0.01 * number)
        for _ in range(3):
            tick(bench, shown, wrench={"sequence": number}, constraints=UNTARED if number < 39 else FREE)
            assert bench.supervisor.trip is None


def test_honest_noise_never_trips():
    bench, readings = tared()
    clean(bench, readings, 3_000)


def test_sample_that_is_no_news_is_no_sign_of_death():
    bench, readings = tared()
    for number in range(200, 300):
        shown = next(readings)
        for _ in range(5):
            tick(bench, shown, wrench={"sequence": number})
            assert bench.supervisor.trip is None


def test_channel_without_declared_noise_may_be_constant():
    bench, readings = Bench(sensor=SensorFacts(0.1, 0.0)), live()
    clean(bench, (shown * (1, 1, 1, 0, 0, 0) for shown in readings), 100)


def test_noise_is_that_of_the_samples_of_its_own_trial():
    bench, readings = Bench(noisy=True), live()
    clean(bench, readings, 40, constraints=UNTARED)
    bench.supervisor.begin()
    bench.snapshots.clear()
    clean(bench, (shown + 2.0 for shown in readings), 20, constraints=UNTARED)
    clean(bench, (shown + 2.0 for shown in readings), 5)
