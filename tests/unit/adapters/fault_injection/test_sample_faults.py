"""Each kind of fault on a sensor, tick by tick, as the core would see it."""

import statistics
from dataclasses import replace
from math import isnan
from typing import Any

import pytest

from palpate.adapters.fault_injection import FaultDelivery, FaultPlan, FaultyForceSensor
from palpate.core.errors import ConfigurationError, DeviceError, FaultLatchedError
from palpate.core.ports.contracts import FakeClock
from palpate.core.ports.values import Validity, WrenchSample
from tests.fake_devices import FakeForceSensor
from tests.unit.adapters.fault_injection.bench import TICK_NS, angles, fz, samples, wrenches

PLAIN = samples()
SETTINGS: dict[str, dict[str, Any]] = {
    "bias-drift": {"magnitude": 1.0},
    "noise": {"magnitude": 1.0},
    "offset": {"magnitude": 1.0},
    "swap": {"channels": (2, 5)},
    "lag": {"time_s": 0.4},
    "spike": {"magnitude": 5.0},
    "saturate": {"magnitude": 400.0},
}


def sequences(found: list[WrenchSample]) -> list[int]:
    return [sample.sequence for sample in found]


def test_drop_gives_the_old_sample_honestly() -> None:
    found = samples(FaultPlan("drop", "force_sensor", 2, duration_ticks=7))
    assert sequences(found) == [0, 1, 1, 1, 1, 1, 1, 1, 1, 9, 10, 11]
    # Five ticks is the greatest age: the sample of tick 1 is over age from tick 7 on.
    assert [s.validity for s in found] == [Validity.VALID] * 7 + [Validity.STALE] * 2 + [Validity.VALID] * 3
    assert {s.source_time_ns for s in found[1:9]} == {TICK_NS}
    assert found[9:] == PLAIN[9:]


def test_drop_from_the_start_leaves_nothing_to_read() -> None:
    found = wrenches(FaultPlan("drop", "force_sensor", duration_ticks=2))
    assert [isinstance(sample, DeviceError) for sample in found[:3]] == [True, True, False]


def test_delay_brings_every_sample_late_with_true_times() -> None:
    found = samples(FaultPlan("delay", "force_sensor", 3, duration_ticks=6, delay_ticks=2))
    assert sequences(found) == [0, 1, 2, 2, 2, 3, 4, 5, 6, 9, 10, 11]
    assert [s.source_time_ns // TICK_NS for s in found] == sequences(found)
    assert [s.receive_time_ns // TICK_NS for s in found[5:9]] == [5, 6, 7, 8]
    assert all(s.validity is Validity.VALID for s in found)


def test_a_long_delay_is_stale() -> None:
    found = samples(FaultPlan("delay", "force_sensor", 1, delay_ticks=6), ticks=20)
    assert sequences(found)[-3:] == [11, 12, 13]
    assert {s.validity for s in found[6:]} == {Validity.STALE}


def test_duplicate_brings_every_sample_twice() -> None:
    found = samples(FaultPlan("duplicate", "force_sensor", 4, duration_ticks=4))
    assert sequences(found) == [0, 1, 2, 3, 3, 5, 5, 7, 8, 9, 10, 11]
    assert found[4] == replace(found[3], receive_time_ns=4 * TICK_NS)


def test_freeze_lies_about_the_value_only() -> None:
    found = samples(FaultPlan("freeze", "force_sensor", 3, duration_ticks=4))
    assert fz(found) == [1, 2, 3, 3, 3, 3, 3, 8, 9, 10, 11, 12]
    assert sequences(found) == sequences(PLAIN)
    assert {s.validity for s in found} == {Validity.VALID}
    one = samples(FaultPlan("freeze", "force_sensor", channels=(0,)))
    assert [s.force_N[0] for s in one] == [1.0] * 12
    assert fz(one) == fz(PLAIN)
    joints = angles(FaultPlan("freeze", "joint_encoder", 5))
    assert len({s.position_rad for s in joints}) == 5
    assert [s.sequence for s in joints] == list(range(12))


def test_repeat_brings_the_old_samples_again() -> None:
    found = samples(FaultPlan("repeat", "force_sensor", 4, duration_ticks=5, span_ticks=3))
    assert sequences(found) == [0, 1, 2, 3, 1, 2, 3, 1, 2, 9, 10, 11]
    assert found[4] == PLAIN[1]
    assert found[7].validity is Validity.STALE


def test_repeat_may_lie_about_number_and_time() -> None:
    found = samples(FaultPlan("repeat", "force_sensor", 4, duration_ticks=5, span_ticks=3, honest=False))
    assert fz(found) == [1, 2, 3, 4, 2, 3, 4, 2, 3, 10, 11, 12]
    assert sequences(found) == sequences(PLAIN)
    assert {s.validity for s in found} == {Validity.VALID}


def test_bias_drifts_slowly() -> None:
    found = samples(FaultPlan("bias-drift", "force_sensor", 2, magnitude=14.0, channels=(2,)))
    error = [round(a - b, 6) for a, b in zip(fz(found), fz(PLAIN), strict=True)]
    assert error == [0.0, 0.0] + [round(0.1 * k, 6) for k in range(10)]
    assert [s.force_N[:2] for s in found] == [s.force_N[:2] for s in PLAIN]
    joints = angles(FaultPlan("bias-drift", "joint_encoder", magnitude=1.4))
    assert joints[10].position_rad == pytest.approx([0.11, 0.12, 0.13])


def test_noise_comes_on_top_of_what_stands_still() -> None:
    dead = FaultPlan("freeze", "force_sensor", 3), FaultPlan("noise", "force_sensor", 3, magnitude=0.1, channels=(2,))
    found = samples(*dead, ticks=1000)
    assert {s.force_N[:2] for s in found[3:]} == {PLAIN[2].force_N[:2]}
    assert statistics.stdev(fz(found[3:])) == pytest.approx(0.1, rel=0.1)
    assert statistics.fmean(fz(found[3:])) == pytest.approx(PLAIN[2].force_N[2], abs=0.02)


def test_an_offset_stays_and_swapped_channels_show_each_other() -> None:
    assert fz(samples(FaultPlan("offset", "force_sensor", magnitude=5.0))) == [f + 5.0 for f in fz(PLAIN)]
    found = samples(FaultPlan("swap", "force_sensor", 3, channels=(2, 5)))
    assert [(s.force_N[2], s.torque_Nm[2]) for s in found[3:]] == [(s.torque_Nm[2], s.force_N[2]) for s in PLAIN[3:]]
    assert [s.force_N[:2] for s in found] == [s.force_N[:2] for s in PLAIN]


@pytest.mark.parametrize("honest", [True, False])
def test_a_lag_grows(honest: bool) -> None:
    found = samples(FaultPlan("lag", "force_sensor", 2, time_s=0.4, honest=honest))
    assert fz(found) == [1, 2, 3, 3, 4, 4, 5, 6, 6, 7, 7, 8]
    assert (sequences(found) == sequences(PLAIN)) is not honest


def test_a_delay_that_is_not_honest_falls_back_at_once() -> None:
    found = samples(FaultPlan("delay", "force_sensor", 5, delay_ticks=3, honest=False))
    assert fz(found) == [1, 2, 3, 4, 5, 3, 4, 5, 6, 7, 8, 9]
    assert sequences(found) == sequences(PLAIN)
    assert [s.source_time_ns for s in found] == [s.source_time_ns for s in PLAIN]


def test_spikes_go_up_and_down() -> None:
    found = samples(FaultPlan("spike", "force_sensor", magnitude=100.0, probability=0.5), ticks=60)
    error = [round(s.force_N[2] - (tick + 1.0)) for tick, s in enumerate(found)]
    assert set(error) == {-100, 0, 100}


def test_nan_is_marked_invalid() -> None:
    found = samples(FaultPlan("nan", "force_sensor", 1, duration_ticks=1, channels=(2, 5)))
    assert found[1].validity is Validity.INVALID
    assert [isnan(x) for x in (*found[1].force_N, *found[1].torque_Nm)] == [False, False, True] * 2
    assert found[2] == PLAIN[2]
    assert angles(FaultPlan("nan", "joint_encoder"))[0].validity is Validity.INVALID


def test_invalid_stays_the_worst_mark() -> None:
    late = FaultPlan("nan", "force_sensor"), FaultPlan("delay", "force_sensor", 1, delay_ticks=8)
    assert {s.validity for s in samples(*late, ticks=30)} == {Validity.INVALID}


@pytest.mark.parametrize(("honest", "mark"), [(True, Validity.SATURATED), (False, Validity.VALID)])
def test_saturation_is_marked_or_not(honest: bool, mark: Validity) -> None:
    plan = FaultPlan("saturate", "force_sensor", 3, magnitude=400.0, channels=(2,), honest=honest)
    found = samples(plan)
    assert fz(found) == [1.0, 2.0, 3.0] + [400.0] * 9
    assert [s.validity for s in found] == [Validity.VALID] * 3 + [mark] * 9


def test_wrong_unit_multiplies() -> None:
    assert fz(samples(FaultPlan("unit", "force_sensor", factor=9.81))) == pytest.approx([9.81 * f for f in fz(PLAIN)])
    degrees = angles(FaultPlan("unit", "joint_encoder", factor=57.29577951308232, channels=(1,)))
    assert degrees[5].position_rad == pytest.approx([0.005, 0.01 * 57.29577951308232, 0.015])


def test_disconnected_raises_from_then_on() -> None:
    found = wrenches(FaultPlan("disconnect", "force_sensor", 4))
    assert [isinstance(sample, DeviceError) for sample in found] == [False] * 4 + [True] * 8
    assert "does not answer" in str(found[4])


def test_reading_twice_in_a_tick_gives_the_same() -> None:
    clock = FakeClock()
    plans = [FaultPlan("spike", "force_sensor", magnitude=5.0, probability=0.5), FaultPlan("duplicate", "force_sensor")]
    with FaultyForceSensor(FakeForceSensor(clock), clock, plans) as sensor:
        for _ in range(20):
            assert sensor.read() == sensor.read()
            clock.advance()


def test_a_fault_of_the_device_itself_comes_through_in_the_same_tick() -> None:
    clock = FakeClock()
    device = FakeForceSensor(clock)
    with FaultyForceSensor(device, clock, [FaultPlan("freeze", "force_sensor")]) as sensor:
        sensor.read()
        device.fail("broken")
        with pytest.raises(FaultLatchedError):
            sensor.read()


def test_deliveries_say_when() -> None:
    delivered: list[FaultDelivery] = []
    wrenches(FaultPlan("freeze", "force_sensor", 3, duration_ticks=4), delivered=delivered)
    # What lasts is reported when it begins.
    text = "values stand still while number and time go on"
    assert delivered == [FaultDelivery(3, 3 * TICK_NS, "freeze", "force_sensor", text)]


def test_what_strikes_by_chance_is_reported_each_time() -> None:
    delivered: list[FaultDelivery] = []
    found = wrenches(FaultPlan("nan", "force_sensor", probability=0.5), ticks=40, delivered=delivered)
    struck = [k for k, s in enumerate(found) if isinstance(s, WrenchSample) and s.validity is Validity.INVALID]
    assert [delivery.tick for delivery in delivered] == struck
    assert 5 < len(struck) < 35


def test_what_had_nothing_to_do_is_not_reported() -> None:
    delivered: list[FaultDelivery] = []
    wrenches(FaultPlan("repeat", "force_sensor"), FaultPlan("duplicate", "force_sensor"), ticks=1, delivered=delivered)
    assert delivered == []


def test_equal_seeds_give_equal_samples_and_others_do_not() -> None:
    def run(seed: int) -> list[WrenchSample]:
        chance = FaultPlan("spike", "force_sensor", magnitude=5.0, probability=0.3, seed=seed)
        return samples(chance, FaultPlan("drop", "force_sensor", 1, probability=0.3, seed=seed), ticks=50)

    assert run(1) == run(1)
    assert run(1) != run(2)


def test_several_plans_meet_the_samples_in_their_order() -> None:
    unit, spike = (
        FaultPlan("unit", "force_sensor", factor=10.0),
        FaultPlan("saturate", "force_sensor", magnitude=3.0, honest=False),
    )
    assert fz(samples(unit, spike)) == [3.0] * 12
    assert fz(samples(spike, unit)) == [30.0] * 12


def test_a_joint_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="numbers from 0 to 2"):
        angles(FaultPlan("nan", "joint_encoder", channels=(3,)))
