"""Simulated trials with injected faults: every fault stops the trial in time, or does no harm."""

from itertools import chain, product

import pytest

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import ready_pose
from palpate.adapters.log import read_log
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.ports import SensorFacts
from tests.golden.fault_plans import arm, square
from tests.golden.fault_scenario import FaultScenario, recorded
from tests.golden.record import shown
from tests.support.fault_list import Fault, device_faults, sensor_faults
from tests.support.fault_trials import Bench, Case, Verdict, cases, run_cases
from tests.support.pegs_6dof import config_of

CONFIG = RunConfig()
DEVICES = device_faults(CONFIG.supervision)


def run(keep, config=CONFIG, *, supervised=True):
    return [
        run for runs in run_cases(config, cases(config, [0], keep), "torque", supervised=supervised) for run in runs
    ]


def test_device_that_fails_stops_the_trial_in_time_or_does_no_harm():
    for one in run(lambda case: case.fault in DEVICES[::9] and case.phase == "explore"):
        assert one.delivered, one
        assert one.safe_stop, one
        assert one.verdict in (Verdict.TOLERABLE, Verdict.DETECTED, Verdict.UNOBSERVABLE), one
        assert bool(one.cause) is (one.verdict is Verdict.DETECTED), one


def test_without_the_supervisor_faults_do_harm():
    spike = "joint_encoder spike 0.1 rad"
    [one] = run(lambda case: case.fault.name == spike and case.phase == "explore", supervised=False)
    assert one.verdict is Verdict.FAILED


def test_tilted_corner_is_not_pushed_on_when_the_sensor_shows_a_tenth_of_the_force_inverted():
    config = config_of("square", "asked", "zebra-zero", {})
    [fault] = [each for each in sensor_faults() if each.name == "sign flipped and times 0.1"]
    [[one]] = run_cases(config, [Case(fault, "explore", 0)], "corner-first")
    assert one.latched
    assert one.peak_force_N < 60.0


FORCE, JOINTS = {"port": "force_sensor"}, {"port": "joint_encoder"}
BACKLOG = {"kind": "lag", "time_s": 0.05, "honest": False}
"""Later and later, by 50 ms a second, under new times."""


LATE = [
    Fault("a backlog of forces that grows", (BACKLOG | FORCE,)),
    Fault("a backlog of angles that grows", (BACKLOG | JOINTS,)),
    Fault("angles 60 ms late under new times", ({"kind": "delay", "delay_ticks": 8, "honest": False} | JOINTS,)),
    Fault("a joint that does not follow", ({"kind": "freeze", "channels": (1,)} | JOINTS,)),
    Fault("an arm that does not follow", ({"kind": "stuck", "port": "arm"},)),
]


def test_zero_that_drifts_while_the_tool_presses_on_the_plate_is_no_descent():
    [fault] = [each for each in sensor_faults() if each.name == "Fz drifts by 7 N/s"]
    drifting = [Case(fault, phase, seed) for seed in (2, 3, 4) for phase in ("approach", "explore")]
    for one in chain.from_iterable(run_cases(CONFIG, drifting, "torque")):
        assert one.latched or one.verdict is Verdict.TOLERABLE, one
        assert one.peak_force_N < 45.0, one


def test_late_samples_under_new_times_and_joints_that_do_not_follow_are_found():
    with SimulatedRig(CONFIG, ready_pose(CONFIG)) as rig:
        bench = Bench(CONFIG, rig, "torque", supervised=True)
        ticks = bench.ticks(1)
        for fault, phase in product(LATE, ("approach", "explore")):
            one = bench.run(fault, phase, ticks[phase][len(ticks[phase]) // 2], 1)
            assert (one.verdict, one.latched, one.safe_stop) == (Verdict.DETECTED, True, True), one
            assert one.peak_force_N < 60.0, one


@pytest.mark.parametrize("trial", [3, pytest.param(6, marks=pytest.mark.nightly)])
def test_square_goes_in_by_an_arm_that_is_29_ms_late(trial, tmp_path):
    late = FaultScenario("inserted", (arm("delay", 0, delay_ticks=4),), square(), policy="corner-first", trial=trial)
    (tmp_path / "late.mcap").write_bytes(recorded(late))
    assert shown(read_log(tmp_path / "late.mcap")) == late.shows


def test_fresh_noise_is_added_after_the_fault_on_every_channel():
    noisy = [fault for fault in sensor_faults() if fault.name.endswith("fresh noise")]
    for fault in noisy:
        *_, force, torque = fault.at(5, 0, SensorFacts(0.1, 0.004))
        assert (force.kind, force.channels, force.magnitude) == ("noise", (0, 1, 2), fault.noise_share * 0.1)
        assert (torque.kind, torque.channels, torque.magnitude) == ("noise", (3, 4, 5), fault.noise_share * 0.004)
