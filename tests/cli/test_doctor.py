"""What ``palpate doctor`` makes of rig files and options. No device is there."""

import json
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from palpate.adapters.hardware.doctor import Examination, FindingsSection
from tests.command_line import CommandLine

RIGS = Path(__file__).parents[2] / "rigs"


TABLES = "[arm]\nadapter = 'zebra-nmc'\n{}\n[force_sensor]\nadapter = 'jr3-uart'\n"


@pytest.mark.parametrize(
    ("content", "words", "named"),
    [
        ("[arm]\n", "--rig rig.toml", "arm.adapter"),
        ("a = [", "--rig rig.toml", "TOML"),
        (TABLES.format("").replace("zebra-nmc", "puma"), "--rig rig.toml", "arm.adapter = 'puma'"),
        (TABLES.format("prot = '/dev/ttyUSB0'"), "--rig rig.toml", "did you mean arm.port?"),
        (TABLES.format("divider = 99"), "--rig rig.toml", "arm.divider = 99"),
        (TABLES.format(""), "--rig rig.toml --seconds 0", "seconds = 0.0"),
        (TABLES.format(""), "", "rig"),
        (TABLES.format(""), "--rig missing.toml", "missing.toml"),
    ],
)
def test_refused_in_one_line(palpate: CommandLine, tmp_path: Path, content: str, words: str, named: str) -> None:
    (tmp_path / "rig.toml").write_text(content)
    assert named in palpate.refusal("doctor", *words.split())


@pytest.mark.parametrize(
    "name", ["zebra-nmc-jr3.toml", "zebra-nmc-ati-netft.toml", "cia402-jr3-uart.toml", "ur5e-ati-netft.toml"]
)
def test_the_shipped_rig_files_can_be_used(palpate: CommandLine, name: str) -> None:
    done = palpate("doctor", "--rig", RIGS / name, "--seconds", "0.2")
    assert done.code in (0, 1), done.stderr
    assert "arm:" in done.stdout
    assert "does not fit" not in done.stdout


def examined(palpate: CommandLine, rig: Path) -> dict[str, Any]:
    """The report as JSON."""
    done = palpate("doctor", "--rig", rig, "--seconds", "1", "--json")
    assert "Traceback" not in done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    assert done.code == (1 if report["wrong"] else 0)
    return report


def wrongs(report: dict[str, Any], section: int) -> list[str]:
    """What is wrong with a device, 1 the arm, 2 the sensor."""
    findings = report["sections"][section]["findings"]
    return [f"{f['text']} -> {f['remedy']}" for f in findings if f["level"] == "wrong"]


def test_what_only_the_driver_refuses_is_a_finding(palpate: CommandLine, tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(
        '[arm]\nadapter = "zebra-nmc"\nport = "/dev/nowhere"\nbaud = 19200\ndivider = 1\n'
        '[force_sensor]\nadapter = "jr3-uart"\nport = "/dev/nowhere/either"\n'
    )
    report = examined(palpate, rig)
    assert any("a cycle at 140 Hz does not fit" in f["text"] for f in report["sections"][1]["findings"])
    assert len(wrongs(report, 2)) == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_end_from_outside_is_one_line(
    palpate: CommandLine, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    def interrupted(examination: Examination) -> Iterator[FindingsSection]:
        signal.raise_signal(number)
        yield FindingsSection("never")

    monkeypatch.setattr(Examination, "sections", interrupted)
    done = palpate("doctor", "--rig", RIGS / "zebra-nmc-jr3.toml")
    assert (done.code, done.stdout, done.stderr) == (130, "", "\npalpate: stopped; every device is closed\n")
