"""Rig files as run refuses them. Nothing here runs in real time."""

from pathlib import Path

import pytest

from palpate.adapters.cli.arguments import parse
from palpate.adapters.cli.options import RunOptions
from palpate.adapters.config.run import RunConfig
from palpate.adapters.hardware import FaultFile
from tests.command_line import JOB
from tests.support.rig_files import zebra_rig

STRANGE = "[arm]\nname = 'zebra-zero'\nadapter = '{}'\n[force_sensor]\nadapter = 'jr3-can'\n"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (
            STRANGE.format("ur-rtde").replace("name = 'zebra-zero'", ""),
            'stated: --arm NAME, or in the rig file [arm] name = "ur5e" or another, or urdf, flange and posture_rad',
        ),
        (STRANGE.format("zebra-nmc") + "node = 3\ncanopen_nodes = [3]\n", "a node that no drive on the bus has"),
        (STRANGE.format("nowhere:make"), "a module that can be imported"),
        (STRANGE.format("os:getcwd"), "must be a function that works; it raised TypeError: "),
        (STRANGE.format("operator:is_"), "function that makes an adapter: ArmAdapter, not False"),
    ],
)
def test_rig_file_that_cannot_work_is_refused_in_one_line(palpate, content, reason):
    Path("rig.toml").write_text(content)
    assert reason in palpate.refusal("run", "--rig", "rig.toml", *JOB, "--policy", "torque", "--out", "run")


def test_a_zebra_is_not_led_by_the_kinematics_of_another_arm(palpate):
    words = ("--arm", "panda", "--policy", "torque", "--trials", "1")
    message = palpate.refusal("run", "--rig", zebra_rig(Path("zebra.toml")), *JOB, *words)
    assert "arm must be zebra-zero, which the rig file has, or none" in message
    Path("rig.toml").write_text(Path("zebra.toml").read_text().replace('name = "zebra-zero"', ""))
    message = palpate.refusal("run", "--rig", "rig.toml", *JOB, *words)
    assert "arm must be zebra-zero, or the URDF of this arm, with 6 joints" in message


def test_the_cell_of_a_file_is_ignored_beside_a_rig_and_that_is_said(palpate):
    Path("settings.toml").write_text("[cell.sensor]\nforce_noise_N = 0.0\n")
    Path("rig.toml").write_text(STRANGE.format("irb"))
    done = palpate("run", "--rig", "rig.toml", *JOB, "--policy", "torque", "--config", "settings.toml")
    said, refused = done.stderr.splitlines()
    assert said == "palpate: [cell] of settings.toml is ignored: the rig file describes the rig"
    assert "one of cia402" in refused
    options = parse(RunOptions, "run", ["--rig", str(zebra_rig(Path("zebra.toml"))), *JOB, "--config", "settings.toml"])
    assert options.run.cell.sensor == RunConfig().cell.sensor


def test_devices_that_are_not_there_are_the_operator_s_to_mend(palpate, tmp_path):
    arm = "[arm]\nname = 'zebra-zero'\nadapter = 'zebra-nmc'\nport = '/dev/ttyNONE'\nat_home = true\n"
    sensor = "[force_sensor]\nadapter = 'jr3-can'\ninterface = 'slcan'\nchannel = '/dev/ttyNONE'\n"
    (tmp_path / "rig.toml").write_text(arm + sensor)
    words = ("run", "--rig", "rig.toml", *JOB, "--policy", "torque", "--out", "run")
    assert "no terminal for a confirmation: --confirm 'rig' lets this rig move" in palpate(*words).stderr
    assert "confirm must be 'rig', the name of this rig" in palpate(*words, "--confirm", "other").stderr
    done = palpate(*words, "--confirm", "rig")
    assert done.code == 1
    assert "the arm of 'rig' will move: from its current pose to 100 mm above (400, 0, 20) mm" in done.stderr
    assert "/dev/ttyNONE: cannot be opened" in done.stderr
    # The same call is to go through once the devices are plugged in.
    assert not (tmp_path / "run").exists()


def faulted(rig="rig.toml"):
    """A rig file whose rig has an open fault."""
    zebra_rig(Path(rig))
    latch = FaultFile(Path(rig))
    latch.set("PLATE_NOT_FOUND: no contact down to 2.93 mm")
    latch.end()


RUN = f"run --rig rig.toml {' '.join(JOB)} --policy torque --out out"
MOVING = (
    RUN,
    RUN.replace("run", "train", 1).replace("policy torque", "learner belief"),
    f"rig calibrate --rig rig.toml {' '.join(JOB)}",
    "rig doctor --rig rig.toml --move",
)


@pytest.mark.parametrize("words", MOVING)
def test_a_rig_with_an_open_fault_is_refused_in_one_line_with_the_option_to_copy(palpate, monkeypatch, words):
    faulted()
    monkeypatch.setattr(
        "palpate.adapters.hardware.arm_client.ArmClient._on_configure", lambda _: pytest.fail("was opened")
    )
    done = palpate(*words.split())
    assert (done.code, len(done.stderr.splitlines())) == (1, 1), done
    assert "PLATE_NOT_FOUND: no contact down to 2.93 mm" in done.stderr
    assert done.stderr.endswith('acknowledge it: --acknowledge "1 NAME: why"\n')
    assert not Path("out").exists()


def test_an_acknowledgement_names_the_open_fault_and_needs_a_rig_that_moves(palpate):
    faulted()
    refused = palpate.refusal(*RUN.split(), "--acknowledge", "2 Ada: fixed")
    assert "acknowledge must be the open fault, 1 (PLATE_NOT_FOUND: no contact" in refused
    assert "left out without --rig" in palpate.refusal("run", "--policy", "torque", "--acknowledge", "1 Ada: fixed")
    assert "left out without --move" in palpate.refusal(
        "rig", "doctor", "--rig", "rig.toml", "--acknowledge", "1 Ada: fixed"
    )


BROKEN = """
from palpate.core.ports import ForceSensor, ManagedDevice

class Sensor(ManagedDevice, ForceSensor):
    def _on_configure(self):
        self.missing_method()

    def read(self):
        raise AssertionError("never called")

def make_sensor(settings, context):
    return Sensor("bench")
"""


def test_an_error_in_an_adapter_names_its_file_and_line(palpate, monkeypatch):
    monkeypatch.syspath_prepend(str(Path.cwd()))
    Path("broken_bench.py").write_text(BROKEN)
    Path("rig.toml").write_text(
        "[arm]\nname = 'zebra-zero'\nadapter = 'zebra-nmc'\nat_home = true\n"
        "[force_sensor]\nadapter = 'broken_bench:make_sensor'\n"
    )
    done = palpate(*RUN.split(), "--confirm", "rig")
    assert done.code == 1
    assert done.stderr.splitlines()[-1].endswith("(broken_bench.py:6); --debug prints the traceback")
    assert "palpate: AttributeError: 'Sensor' object has no attribute 'missing_method'" in done.stderr
