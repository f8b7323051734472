"""What ``palpate doctor`` makes of rig files and options. No device is there."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from tests.integration.command_line import palpate, refusal, succeed

RIGS = Path(__file__).parents[2] / "rigs"


def test_rig_files_and_options_that_cannot_be_used(tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    tables = '[arm]\nadapter = "zebra-nmc"\n{}\n[force_sensor]\nadapter = "jr3-uart"\n'
    for text, named in (
        ("[arm]\n", "arm.adapter"),
        ("a = [", "TOML"),
        (tables.replace("zebra-nmc", "puma"), "arm.adapter = 'puma'"),
        (tables.format('prot = "/dev/ttyUSB0"'), "did you mean arm.port?"),
        (tables.format("divider = 99"), "arm.divider = 99"),
    ):
        rig.write_text(text.replace("{}", ""))
        assert named in refusal("doctor", "--rig", rig)
    rig.write_text(tables.format(""))
    assert "seconds = 0.0" in refusal("doctor", "--rig", rig, "--seconds", "0")
    assert "rig" in refusal("doctor")
    assert "missing.toml" in refusal("doctor", "--rig", tmp_path / "missing.toml")


@pytest.mark.parametrize("name", ["zebra-nmc-jr3.toml", "cia402-jr3-uart.toml"])
def test_the_shipped_rig_files_can_be_used(name: str) -> None:
    done = palpate("doctor", "--rig", RIGS / name, "--seconds", "0.2")
    assert done.returncode in (0, 1), done.stderr
    assert "arm:" in done.stdout
    assert "does not fit" not in done.stdout


def examined(rig: Path) -> dict[str, Any]:
    """The report as JSON."""
    done = palpate("doctor", "--rig", rig, "--seconds", "1", "--json")
    assert "Traceback" not in done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    assert done.returncode == (1 if report["wrong"] else 0)
    return report


def wrongs(report: dict[str, Any], section: int) -> list[str]:
    """What is wrong with a device, 1 the arm, 2 the sensor."""
    findings = report["sections"][section]["findings"]
    return [f"{f['text']} -> {f['remedy']}" for f in findings if f["level"] == "wrong"]


def test_what_only_the_driver_refuses_is_a_finding(tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(
        '[arm]\nadapter = "zebra-nmc"\nport = "/dev/nowhere"\nbaud = 19200\ndivider = 1\n'
        '[force_sensor]\nadapter = "jr3-uart"\nport = "/dev/nowhere/either"\n'
    )
    report = examined(rig)
    assert any("a cycle at 140 Hz does not fit" in f["text"] for f in report["sections"][1]["findings"])
    assert len(wrongs(report, 2)) == 1


def test_a_port_without_permission(tmp_path: Path) -> None:
    port = tmp_path / "port"
    port.touch(mode=0)
    if os.access(port, os.R_OK):
        pytest.skip("root may open everything")
    rig = tmp_path / "rig.toml"
    rig.write_text(
        f'[arm]\nadapter = "zebra-nmc"\nport = "{port}"\n[force_sensor]\nadapter = "jr3-uart"\nport = "{port}2"\n'
    )
    assert "dialout" in wrongs(examined(rig), 1)[0]


def test_help() -> None:
    printed = succeed("doctor", "--help")
    assert all(flag in printed for flag in ("--rig", "--seconds", "--push", "--move", "--json"))
