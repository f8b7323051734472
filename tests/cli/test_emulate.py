"""``palpate emulate``: the rig file and the job file that it leaves, and when it replaces them."""

import tomllib
from pathlib import Path

import pytest

from palpate.adapters.cli import emulate as command
from palpate.adapters.hardware import EmulatedCell

DOWEL = Path(__file__).parents[2] / "examples" / "jobs" / "dowel-12-h7.toml"


@pytest.fixture
def emulate(palpate, monkeypatch):
    """The command line, where devices are served for no time."""
    monkeypatch.setattr(EmulatedCell, "run", lambda *_: None)
    monkeypatch.setattr(command.__name__ + ".take_real_time", str)
    return palpate


@pytest.mark.parametrize(("arm", "wires", "force"), [("ur10e", "ur-rtde", "ati-netft"), ("panda", "cia402", "jr3-can")])
def test_a_run_needs_the_rig_file_only(emulate, arm, wires, force):
    emulate.succeed("emulate", "--job", DOWEL, "--arm", arm, "--rig-file", "rig.toml")
    rig, job = (tomllib.loads(Path(name).read_text()) for name in ("rig.toml", "rig.job.toml"))
    assert rig["rig"]["job"] == "rig.job.toml"
    assert (rig["arm"]["adapter"], rig["arm"]["name"], rig["force_sensor"]["adapter"]) == (wires, arm, force)
    assert set(job) == {"part", "tool", "place", "limits", "arm"}
    stated = tomllib.loads(DOWEL.read_text())
    assert {name: job["tool"][name] for name in stated["tool"]} == stated["tool"]
    assert job["arm"] == {"name": arm}


def test_a_restart_replaces_what_it_wrote_and_nothing_else(emulate):
    emulate.succeed("emulate", "--rig-file", "rig.toml")
    emulate.succeed("emulate", "--wires", "cia402", "--rig-file", "rig.toml")
    written = Path("rig.toml").read_text()
    assert "cia402" in written
    Path("rig.toml").write_text(written + "[calibration]\nplate_mm = 21.0\n")
    message = emulate.refusal("emulate", "--rig-file", "rig.toml")
    assert (
        "rig.toml: exists, and was changed since palpate emulate wrote it; name another file with --rig-file" in message
    )
    Path("rig.toml").unlink()
    Path("rig.job.toml").write_text(DOWEL.read_text())
    assert "rig.job.toml: exists" in emulate.refusal("emulate", "--rig-file", "rig.toml")


def test_ros2_serves_arm_and_wrench_in_one_domain(emulate):
    pytest.importorskip("cyclonedds", reason="needs the extra ros2")
    emulate.succeed("emulate", "--wires", "ros2", "--arm", "panda", "--rig-file", "rig.toml")
    rig = tomllib.loads(Path("rig.toml").read_text())
    assert (rig["arm"]["adapter"], rig["force_sensor"]["adapter"]) == ("ros2", "ros2")
    assert rig["arm"]["domain"] == rig["force_sensor"]["domain"]
    assert "another sensor, or wires ros2 too" in emulate.refusal("emulate", "--wires", "cia402", "--force", "ros2")
