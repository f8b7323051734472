"""Simulated trials with injected faults: every fault stops the trial in time, or does no harm."""

import pytest

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import ready_pose
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.ports import SensorFacts
from tests.support.fault_trials import (
    Bench,
    Case,
    Fault,
    Verdict,
    cases,
    device_faults,
    run_cases,
    sensor_faults,
)
from tests.support.pegs_6dof import config_of

CONFIG = RunConfig()
DEVICES = device_faults(CONFIG.supervision)


def run(keep, config=CONFIG, *, supervised=True):
    return [
        run for runs in run_cases(config, cases(config, [0], keep), "torque", supervised=supervised) for run in runs
    ]


@pytest.mark.parametrize("fault", DEVICES[::3], ids=lambda fault: fault.name)
def test_a_device_that_fails_stops_the_trial_in_time_or_does_no_harm(fault):
    [one] = run(lambda case: case.fault == fault and case.phase == "explore")
    assert one.delivered
    assert one.safe_stop
    assert one.verdict in (Verdict.TOLERABLE, Verdict.DETECTED, Verdict.UNOBSERVABLE)
    assert bool(one.cause) is (one.verdict is Verdict.DETECTED)


def test_without_the_supervisor_faults_do_harm():
    spike = "joint_encoder spike 0.1 rad"
    [one] = run(lambda case: case.fault.name == spike and case.phase == "explore", supervised=False)
    assert one.verdict is Verdict.FAILED


def test_a_tilted_corner_is_not_pushed_on_when_the_sensor_shows_a_tenth_of_the_force_inverted():
    config = config_of("square", "asked", "zebra-zero", {})
    [fault] = [each for each in sensor_faults() if each.name == "sign flipped and times 0.1"]
    [[one]] = run_cases(config, [Case(fault, "explore", 0)], "corner-first")
    assert one.latched
    assert one.peak_force_N < 60.0


FORCE, JOINTS = {"port": "force_sensor"}, {"port": "joint_encoder"}
BACKLOG = {"kind": "lag", "time_s": 0.05, "honest": False}
"""Later and later, by 50 ms a second, under new times."""


@pytest.mark.parametrize(
    ("name", "plan"),
    [
        ("a backlog of forces that grows", BACKLOG | FORCE),
        ("a backlog of angles that grows", BACKLOG | JOINTS),
        ("angles 60 ms late under new times", {"kind": "delay", "delay_ticks": 8, "honest": False} | JOINTS),
        ("a joint that does not follow", {"kind": "freeze", "channels": (1,)} | JOINTS),
        ("an arm that does not follow", {"kind": "stuck", "port": "arm"}),
    ],
)
@pytest.mark.parametrize("phase", ["approach", "explore"])
def test_what_comes_late_under_new_times_or_does_not_follow_is_found(name, plan, phase):
    with SimulatedRig(CONFIG, ready_pose(CONFIG)) as rig:
        bench = Bench(CONFIG, rig, "torque", supervised=True)
        ticks = bench.ticks(1)[phase]
        one = bench.run(Fault(name, (plan,)), phase, ticks[len(ticks) // 2], 1)
    assert (one.verdict, one.latched, one.safe_stop) == (Verdict.DETECTED, True, True)
    assert one.peak_force_N < 60.0


def test_fresh_noise_is_added_after_the_fault_on_every_channel():
    noisy = [fault for fault in sensor_faults() if fault.name.endswith("fresh noise")]
    for fault in noisy:
        *_, force, torque = fault.at(5, 0, SensorFacts(0.1, 0.004))
        assert (force.kind, force.channels, force.magnitude) == ("noise", (0, 1, 2), fault.noise_share * 0.1)
        assert (torque.kind, torque.channels, torque.magnitude) == ("noise", (3, 4, 5), fault.noise_share * 0.004)
