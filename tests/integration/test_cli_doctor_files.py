"""What ``palpate doctor`` makes of rig files and options. No device is there."""

from __future__ import annotations

from pathlib import Path

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


def test_help() -> None:
    printed = succeed("doctor", "--help")
    assert all(flag in printed for flag in ("--rig", "--seconds", "--push", "--move", "--json"))
