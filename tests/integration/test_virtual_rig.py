"""Rigs in virtual time: real drivers and emulated devices, and how old angles are that come over their wires."""

import re
from dataclasses import replace

import pytest

from palpate.adapters.config import overlay, scenario, task_kind
from palpate.adapters.experiments import Run
from palpate.adapters.log import find_logs, read_log
from palpate.core.errors import DeviceError
from palpate.core.ports import CONTROL_RATE_HZ
from palpate.core.trial import Outcome
from palpate.simulation.work_cell import HiddenValues
from tests.virtual_rig import VirtualRig
from tests.virtual_time import Timer

LATE = HiddenValues(springs_share=0.7, friction=0.35, latency_ms=20.0)


# Where the bus is read at every second tick, half a tick on average, more by the transfer, and up to one by the phase.
@pytest.mark.parametrize(
    ("kind", "arm", "force", "age_ticks"),
    [
        ("zebra-zero", "zebra-nmc", "jr3-can", (0.7, 1.8)),
        pytest.param("zebra-zero", "cia402", "jr3-can", (0.5, 1.7), marks=pytest.mark.nightly),
        pytest.param("ur5e", "ur-rtde", "ati-netft", (0.0, 1.0), marks=pytest.mark.nightly),
        pytest.param("ur5e", "ros2", "ros2", (0.0, 1.0), marks=pytest.mark.nightly),
    ],
)
def test_trial_over_virtual_wires_is_inserted_and_tells_how_old_its_angles_are(kind, arm, force, age_ticks, tmp_path):
    springs = {"control": {"axial_stiffness_N_per_mm": 3.5}}
    config = overlay(replace(scenario("paper"), seed=6, arm=kind), springs)
    run = Run(config, make_rig=lambda *parts: VirtualRig(*parts, arm, force, LATE, phase=0.4))
    run.evaluate(1, "torque", tmp_path)
    (path,) = find_logs([str(tmp_path)])
    log = read_log(path)
    assert log.end.outcome == Outcome.INSERTED.value
    read = [(each.time_ns, each.joints) for each in log.records() if each.joints is not None]
    ages_ns = [time_ns - joints.source_time_ns for time_ns, joints in read if time_ns is not None]
    age = sum(ages_ns) / len(ages_ns) * 1e-9 * CONTROL_RATE_HZ
    assert age_ticks[0] < age < age_ticks[1]


def struck(arm, force, strike, at_ns=200_000_000):
    """How a trial ends that is struck some time after its beginning."""
    config = replace(scenario("paper"), seed=3, arm="ur5" if arm == "ur-rtde" else "zebra-zero")
    run = Run(config, make_rig=lambda *parts: VirtualRig(*parts, arm, force, HiddenValues(), phase=0.4))
    with run.opened() as rig:
        prepare, timer = rig.prepare, Timer(rig.desk.clock)

        def then(trial):
            prepare(trial)
            timer.after(at_ns, lambda: strike(rig))

        rig.prepare = then
        try:
            run.evaluate(1, "torque")
        except DeviceError as error:
            return str(error)
    return "went on"


@pytest.mark.parametrize(
    ("arm", "force", "event", "message"),
    [
        ("ur-rtde", "ati-netft", "protective-stop", "protective stop; clear what the arm has met, and unlock it"),
        ("ur-rtde", "ati-netft", "sensor-silent", r"^rig: trial 0: .*stale \(ATI Net F/T: nothing new for 5. ms"),
        ("ur-rtde", "ati-netft", "sensor-cable", "transducer unplugged"),
        ("zebra-nmc", "jr3-can", "emergency-stop", "motor supply is off; check emergency stop and motor supply"),
        *(
            pytest.param(*more, marks=pytest.mark.nightly)
            for more in (
                ("ur-rtde", "ati-netft", "emergency-stop", "release the button, power on and release the brakes"),
                ("ur-rtde", "ati-netft", "program-end", "switch back to remote control"),
                ("zebra-nmc", "jr3-can", "sensor-silent", "check power, wiring"),
                ("zebra-nmc", "jr3-can", "sensor-cable", "that the sensor is plugged into its board"),
            )
        ),
    ],
)
def test_rehearsed_fault_ends_a_trial_in_words_that_say_what_to_do(arm, force, event, message):
    assert re.search(message, struck(arm, force, lambda rig: rig.cell._faults[event]()))


@pytest.mark.nightly
def test_replies_of_a_motor_that_come_again_are_not_taken_for_another_s():
    """They carry no address: a trial in four ended as if a joint had moved at 4 rad/s."""

    def again(rig):
        port, timer = rig.desk.port("arm"), Timer(rig.desk.clock)
        step = port.line.step

        def twice(now_ns):
            came = step(now_ns)
            for data in came:
                timer.after(1_000_000, lambda data=data: port.put(data))
            if came:
                port.line.step = step
            return came

        port.line.step = twice

    assert struck("zebra-nmc", "jr3-can", again, 540_000_000) == "went on"


@pytest.mark.nightly
def test_squares_go_in_one_after_the_other_on_an_arm_that_lags(tmp_path):
    """The second begins in the hole, with a turned tool; each pushes at walls with an arm 20 to 35 ms behind."""
    config = overlay(
        overlay(scenario("paper"), task_kind("insertion-6dof").preset),
        {
            "seed": 51004,
            "task": {"name": "insertion-6dof", "options": {"corners": 4.0, "corner_mm": 20.5}},
            "cell": {
                "tilt_mrad": 4.0, "hole_uncertainty_mm": 3.0, "peg": {"cross_section": "square"},
                "conditions": {
                    "tilt_heading": "drawn", "grip_trials": 1, "yaw_deg": 5.0, "plate_tilt_mrad": 17.5
                },
            },
        },
    )  # fmt: skip
    rig = lambda *parts: VirtualRig(*parts, "zebra-nmc", "jr3-can", HiddenValues(), phase=0.4)  # noqa: E731
    Run(config, make_rig=rig).evaluate(2, "corner-first", tmp_path)
    ends = [read_log(path).end for path in find_logs([str(tmp_path)])]
    assert [end and end.outcome for end in ends] == [Outcome.INSERTED.value] * 2
