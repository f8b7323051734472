"""What ``palpate rig doctor`` makes of rig files and options. No device is there."""

import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from palpate.adapters.hardware.doctor import DeviceReport, Examination
from tests.command_line import CommandLine

ROOT = Path(__file__).parents[2]


@pytest.fixture
def shipped(tmp_path: Path) -> Callable[[str], Path]:
    """Copies a shipped rig file next to a job, as its first lines say."""

    def copied(name: str) -> Path:
        shutil.copy(ROOT / "examples/jobs/paper-peg.toml", tmp_path / "job.toml")
        return Path(shutil.copy(ROOT / "rigs" / name, tmp_path))

    return copied


@pytest.mark.parametrize(
    "name", ["zebra-nmc-jr3.toml", "zebra-nmc-ati-netft.toml", "cia402-jr3-can.toml", "ur5e-ati-netft.toml"]
)
def test_the_shipped_rig_files_can_be_used(palpate: CommandLine, shipped: Callable[[str], Path], name: str) -> None:
    done = palpate("rig", "doctor", "--rig", shipped(name), "--seconds", "0.2")
    assert done.code in (0, 1), done.stderr
    assert "arm:" in done.stdout
    assert "does not fit" not in done.stdout


def test_what_only_the_driver_refuses_is_a_finding(palpate: CommandLine, tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(
        '[arm]\nname = "zebra-zero"\nadapter = "zebra-nmc"\nport = "/dev/nowhere"\nbaud = 19200\ndivider = 1\n'
        '[force_sensor]\nadapter = "jr3-can"\ninterface = "slcan"\nchannel = "/dev/nowhere/either"\n'
    )
    done = palpate("rig", "doctor", "--rig", rig, "--seconds", "1")
    assert (done.code, done.stderr) == (1, "")
    of_arm, of_sensor = done.stdout.split("force sensor: jr3-can")
    assert "a cycle at 140 Hz does not fit" in of_arm
    assert of_sensor.count("  wrong  ") == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_end_from_outside_is_one_line(
    palpate: CommandLine,
    shipped: Callable[[str], Path],
    monkeypatch: pytest.MonkeyPatch,
    number: signal.Signals,
) -> None:
    def interrupted(examination: Examination) -> Iterator[DeviceReport]:
        signal.raise_signal(number)
        yield DeviceReport("never")

    monkeypatch.setattr(Examination, "reports", interrupted)
    done = palpate("rig", "doctor", "--rig", shipped("zebra-nmc-jr3.toml"))
    assert (done.code, done.stdout, done.stderr) == (130, "", "\npalpate: stopped; every device is closed\n")
