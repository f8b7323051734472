"""Silence is never taken for news, whatever the device says of it."""

from __future__ import annotations

from dataclasses import replace
from math import nan
from typing import cast

import pytest

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import build_perception, build_task, comparator, run_scored_trial, supervisor_of
from palpate.adapters.hardware.watchdogs import WatchdogTrip, WatchedForceSensor, WatchedJointEncoder
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import ConfigurationError, DeviceError, FaultLatchedError
from palpate.core.ports import JointEncoder, JointSample, SensorDecorator, Validity, WrenchSample
from palpate.core.ports.contracts import TICK_NS, FakeClock
from palpate.core.trial import Outcome, TripReason
from tests.fake_devices import FakeForceSensor, FakeJointEncoder
from tests.support.faults import FaultPlan, FaultyForceSensor
from tests.unit.adapters.samples import ready_pose

NEVER_NS = 10**15
AGE_NS, DEAD_NS = 3 * TICK_NS, 6 * TICK_NS


def outcomes(sensor: WatchedForceSensor | WatchedJointEncoder, clock: FakeClock, ticks: int) -> str:
    """One letter a tick: the first of the validity's name, or D for an error."""
    letters = ""
    for _ in range(ticks):
        try:
            letters += sensor.read().validity.value[0]
        except DeviceError:
            letters += "D"
        clock.advance()
    return letters


def test_silence_is_stale_and_then_an_error_until_there_is_news() -> None:
    clock, told = FakeClock(), list[WatchdogTrip]()
    device = FakeForceSensor(clock, max_age_ns=NEVER_NS)
    with WatchedForceSensor(device, clock, AGE_NS, dead_after_ns=DEAD_NS, tell=told.append) as sensor:
        assert outcomes(sensor, clock, 3) == "vvv"
        device.silent = True
        assert outcomes(sensor, clock, 9) == "vvvsssDDD"
        device.silent = False
        assert outcomes(sensor, clock, 2) == "vv"
    assert [(trip.source, trip.text.split(":")[0]) for trip in told] == [
        ("force sensor", "stale"),
        ("force sensor", "dead"),
    ]
    assert "no new sample for 28.6 ms" in told[0].text


def test_encoders_likewise() -> None:
    clock = FakeClock()
    device = FakeJointEncoder(clock, lambda: (0.0,), max_age_ns=NEVER_NS)
    with WatchedJointEncoder(device, clock, AGE_NS, dead_after_ns=DEAD_NS) as encoder:
        assert outcomes(encoder, clock, 1) == "v"
        device.silent = True
        assert outcomes(encoder, clock, 8) == "vvvsssDD"


class SameNumber(FakeForceSensor):
    """Gives every sample a new time and the number of the first."""

    def read(self) -> WrenchSample:
        return replace(super().read(), sequence=0)


def test_new_times_under_an_old_number_are_no_news() -> None:
    clock = FakeClock()
    with WatchedForceSensor(SameNumber(clock), clock, AGE_NS, dead_after_ns=DEAD_NS) as sensor:
        assert outcomes(sensor, clock, 8) == "vvvvsssD"


def test_late_samples_are_stale_but_the_sensor_lives() -> None:
    clock = FakeClock()
    late = [FaultPlan("delay", "force_sensor", 1, delay_ticks=4)]
    device = FaultyForceSensor(FakeForceSensor(clock), clock, late, max_age_ns=NEVER_NS)
    with WatchedForceSensor(device, clock, AGE_NS, dead_after_ns=DEAD_NS) as sensor:
        assert outcomes(sensor, clock, 20) == "vvvv" + "s" * 16


def test_a_number_that_goes_back_is_no_news() -> None:
    clock, told = FakeClock(), list[WatchdogTrip]()
    again = [FaultPlan("repeat", "force_sensor", 3, duration_ticks=3, span_ticks=2)]
    device = FaultyForceSensor(FakeForceSensor(clock), clock, again, max_age_ns=NEVER_NS)
    with WatchedForceSensor(device, clock, AGE_NS, dead_after_ns=DEAD_NS, tell=told.append) as sensor:
        assert outcomes(sensor, clock, 9) == "vvvsvsvvv"
    assert "sample 1 came after sample 2" in told[0].text


def test_what_is_invalid_stays_so() -> None:
    clock = FakeClock()
    broken = [FaultPlan("nan", "force_sensor"), FaultPlan("drop", "force_sensor", 1)]
    device = FaultyForceSensor(FakeForceSensor(clock), clock, broken, max_age_ns=NEVER_NS)
    with WatchedForceSensor(device, clock, AGE_NS, dead_after_ns=NEVER_NS) as sensor:
        assert outcomes(sensor, clock, 8) == "i" * 8


def test_activated_again_it_counts_anew() -> None:
    clock = FakeClock()
    device = FakeForceSensor(clock, max_age_ns=NEVER_NS)
    with WatchedForceSensor(device, clock, AGE_NS, dead_after_ns=DEAD_NS) as sensor:
        assert sensor.read().validity is Validity.VALID
        sensor.deactivate()
        clock.advance(1000)
        sensor.activate()
        assert sensor.read().validity is Validity.VALID
    encoder = WatchedJointEncoder(FakeJointEncoder(clock, lambda: (0.0,)), clock, AGE_NS, dead_after_ns=DEAD_NS)
    with encoder:
        assert encoder.read().position_rad == (0.0,)


@pytest.mark.parametrize("limits", [(0, 1), (5, 4)])
def test_limits_must_make_sense(limits: tuple[int, int]) -> None:
    with pytest.raises(ConfigurationError, match="second limit"):
        WatchedForceSensor(FakeForceSensor(FakeClock()), FakeClock(), limits[0], dead_after_ns=limits[1])


class Garbling(FakeJointEncoder):
    """Says something else when told to."""

    garbled: tuple[float, ...] | None = None

    def read(self) -> JointSample:
        sample = super().read()
        return sample if self.garbled is None else replace(sample, position_rad=self.garbled)


@pytest.mark.parametrize(
    ("garbled", "words"),
    [
        ((0.1, 0.2), "gives 2 joint angles, the arm has 1"),
        ((nan,), "gives no sample (joint angles that are not finite"),
    ],
)
def test_what_makes_no_sense_is_the_last_sample_marked_invalid(garbled: tuple[float, ...], words: str) -> None:
    clock, told = FakeClock(), list[WatchdogTrip]()
    device = Garbling(clock, lambda: (0.5,))
    watched = WatchedJointEncoder(device, clock, AGE_NS, dead_after_ns=DEAD_NS, tell=told.append, joints=1)
    with watched as encoder:
        encoder.read()
        device.garbled = garbled
        # The supervisor trips at the first and needs the samples of a whole retreat.
        for _ in range(20):
            clock.advance()
            sample = encoder.read()
            assert (sample.validity, sample.position_rad) == (Validity.INVALID, (0.5,))
    (trip,) = told
    assert trip.source == "joint encoder"
    assert words in trip.text


def test_what_never_made_sense_is_an_error_of_the_device() -> None:
    clock = FakeClock()
    device = Garbling(clock, lambda: (0.5,))
    device.garbled = (nan,)
    with (
        WatchedJointEncoder(device, clock, AGE_NS, dead_after_ns=DEAD_NS, joints=1) as encoder,
        pytest.raises(DeviceError, match="joint encoder: gives no sample"),
    ):
        encoder.read()


@pytest.mark.parametrize("garbled", [(0.1,) * 5, (nan,) * 6])
def test_an_arm_that_gives_nonsense_in_mid_trial_is_led_back_and_latched(garbled: tuple[float, ...]) -> None:
    config = RunConfig()
    ready = ready_pose()
    with SimulatedRig(config, ready) as rig:
        ports = rig.ports

        def late(sample: JointSample) -> JointSample:
            return sample if ports.clock.now_ns() < begin_ns + 4 * 10**8 else replace(sample, position_rad=garbled)

        begin_ns = ports.clock.now_ns()
        spoiled = SensorDecorator[JointSample](ports.joint_encoder, late)
        encoder = WatchedJointEncoder(
            cast(JointEncoder, spoiled), ports.clock, NEVER_NS, dead_after_ns=NEVER_NS, joints=6
        )
        # As a rig of devices: in the simulator a trip is a result.
        rig.simulated, rig.ports = False, replace(ports, joint_encoder=encoder)
        task = build_task(config, ready, build_perception(config), comparator("torque", config, tuple))
        supervisor = supervisor_of(rig, config, ready)
        report = run_scored_trial(config, rig, task, 0, supervisor=supervisor).report
        assert (report.outcome, supervisor.trip and supervisor.trip.reason) == (
            Outcome.SENSOR_FAULT, TripReason.SAMPLE_INVALID,
        )  # fmt: skip
        with pytest.raises(FaultLatchedError):
            run_scored_trial(config, rig, task, 1, supervisor=supervisor_of(rig, config, ready))
