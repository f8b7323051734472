"""What ``palpate rig doctor`` makes of rig files and options. No device is there."""

import re
import shutil
import signal
from pathlib import Path

import pytest

from palpate.adapters.config import RigFile, overlay
from palpate.adapters.hardware import load_maker, settings_table
from palpate.adapters.hardware.doctor import DeviceReport, Examination
from tests.command_line import JOB
from tests.support.rig_files import zebra_rig


@pytest.mark.parametrize(
    ("arm", "force", "model"),
    [
        ("zebra-nmc", "jr3-can", "zebra-zero"),
        ("cia402", "ati-netft", "zebra-zero"),
        pytest.param("ur-rtde", "ur-rtde", "ur5e", marks=pytest.mark.nightly),
    ],
)
def test_new_rig_file_can_be_examined(palpate, capfd, arm, force, model):
    Path("rig.toml").write_text(palpate.succeed("rig", "new", "--arm", arm, "--force", force, "--model", model))
    Path("job.toml").write_text(palpate.succeed("rig", "new", "--job"))
    file = RigFile.load(Path("rig.toml"))
    for kind, entry in (("arm", file.arm), ("force", file.force_sensor)):
        table = settings_table(load_maker(kind, entry.adapter))
        assert overlay(table(), entry.settings) == table()
    assert "verdict: feasible" in palpate.succeed("plan", "job.toml")
    # Nothing is asked of whatever has these addresses here.
    text = re.sub(r"^#? ?(host) = .*", r'\1 = "127.0.0.1"', Path("rig.toml").read_text(), flags=re.M)
    Path("rig.toml").write_text(text)
    done = palpate("rig", "doctor", "--rig", "rig.toml", "--seconds", "0.2")
    # A drive's counts per radian cannot be known.
    assert (done.code, "counts_per_rad" in done.stderr) in ((1, False), (2, True)), done
    assert "the loop ended" not in capfd.readouterr().err


def test_refusal_of_the_driver_alone_is_a_finding(palpate, tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text(
        '[arm]\nname = "zebra-zero"\nadapter = "zebra-nmc"\nport = "/dev/nowhere"\nbaud = 19200\ndivider = 1\n'
        '[force_sensor]\nadapter = "jr3-can"\ninterface = "slcan"\nchannel = "/dev/nowhere/either"\n'
    )
    done = palpate("rig", "doctor", "--rig", rig, "--seconds", "1")
    assert (done.code, done.stderr) == (1, "")
    of_arm, of_sensor = done.stdout.split("force sensor: jr3-can")
    assert "choose a larger divider, a higher baud rate" in of_arm
    assert of_sensor.count("  wrong  ") == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_end_from_outside_is_one_line(palpate, monkeypatch, number):
    def interrupted(examination):
        signal.raise_signal(number)
        yield DeviceReport("never")

    monkeypatch.setattr(Examination, "reports", interrupted)
    shutil.copy(JOB[1], "job.toml")
    done = palpate("rig", "doctor", "--rig", zebra_rig(Path("rig.toml")))
    assert (done.code, done.stdout, done.stderr) == (130, "", "\npalpate: stopped; every device is closed\n")
