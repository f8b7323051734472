"""``palpate doctor`` in a process of its own, on devices that ``palpate emulate`` serves."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from palpate.adapters.config.rig import RigFile
from tests.command_line import RT_EMULATOR, command, in_own_process, wait_until
from tests.wall_clock.host import Host, LateError

DISTURBED = re.compile(
    "computer wakes|were lost or damaged|do not fit|silent|answers missing|SYNCs in a row|readings missing|instead of"
    "|heartbeat|adapter adds|clumps|no new reading|no answer from module|No SDO response"
)
"""What a machine with other work to do may bring about by itself."""
ALLOWED_S = 0.002
"""So late may a plain sleeper come on a host that is called in time."""
SLOW = ("--divider", "4")
"""A cycle in which an emulator has time to compute on a processor that others slow down."""


@contextmanager
def emulated(folder: Path, *words: str) -> Iterator[tuple[Path, subprocess.Popen[str]]]:
    """A rig file whose devices are served, and the process that does it."""
    rig = folder / "rig.toml"
    with subprocess.Popen(
        command("emulate", "--rig-file", rig, *RT_EMULATOR, *words),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as process:
        try:
            wait_until(lambda: rig.exists() and "force_sensor" in rig.read_text(), process)
            yield rig, process
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=20)


def examined(rig: Path, *words: str) -> dict[str, Any]:
    """The report as JSON, and since when it was being made."""
    began_s = time.monotonic()
    done = in_own_process("doctor", "--rig", rig, "--seconds", "1", "--json", *words)
    assert "Traceback" not in done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    assert done.code == (1 if report["wrong"] else 0)
    return {**report, "began_s": began_s}


def wrongs(host: Host, report: dict[str, Any], section: int) -> list[str]:
    """What is wrong with a device, 1 the arm, 2 the sensor, besides what it is right to say of a host that came late.

    Raises:
        LateError: It says so of a host that did not.
    """
    findings = report["sections"][section]["findings"]
    told = [f"{f['text']} -> {f['remedy']}" for f in findings if f["level"] == "wrong"]
    late = [line for line in told if DISTURBED.search(line)]
    if late and host.lateness_s(report["began_s"]) <= ALLOWED_S:
        raise LateError("; ".join(late))
    return [line for line in told if line not in late]


def facts(report: dict[str, Any], section: int) -> dict[str, str]:
    return {fact["name"]: fact["text"] for fact in report["sections"][section]["facts"]}


def test_zebra_and_jr3_on_can(tmp_path: Path, host: Host) -> None:
    with emulated(tmp_path, *SLOW) as (rig, _):
        report = examined(rig)
        assert not [line for section in range(3) for line in wrongs(host, report, section)]
        arm, sensor = facts(report, 1), facts(report, 2)
        assert arm["modules"].startswith("6, ")
        assert arm["woken by us"].startswith("yes")
        assert "node 9" in sensor["identity"]
        (table,) = report["sections"][1]["tables"]
        assert [row[2] for row in table["rows"]] == ["off"] * 6
        # Text this time, with the step; the counters were kept, so the arm still knows where it is.
        done = in_own_process("doctor", "--rig", rig, "--seconds", "0.5", "--move")
        assert "woken by us      no" in done.stdout
        assert any(words in done.stdout for words in ("mrad asked of the last joint", "nothing was moved", "wrong"))
        # The sensor's CAN adapter behind the arm's port.
        text = rig.read_text()
        file = RigFile.load(rig)
        port, channel = file.arm.settings["port"], file.force_sensor.settings["channel"]
        swapped = tmp_path / "swapped.toml"
        swapped.write_text(text.replace(f'"{channel}"', '"/dev/nowhere"').replace(f'"{port}"', f'"{channel}"'))
        report = examined(swapped)
        (line,) = wrongs(host, report, 1)
        assert " -> " in line
        assert any("another device" in f["text"] for f in report["sections"][1]["findings"])
        (line,) = wrongs(host, report, 2)
        assert line.startswith("there is no /dev/nowhere -> plug it in")


def test_cia402_and_jr3_on_a_serial_line(tmp_path: Path, host: Host) -> None:
    with emulated(tmp_path, "--arm", "cia402", "--force", "jr3-uart", *SLOW) as (rig, _):
        report = examined(rig, "--push")
        assert not wrongs(host, report, 1)
        (line,) = wrongs(host, report, 2)
        assert line.startswith("the signs were not checked: nobody answered")
        assert facts(report, 1)["drives"].startswith("6, nodes 1, 2, 3, 4, 5, 6")
        states, _ = report["sections"][1]["tables"]
        assert not any("enabled" in row[6] for row in states["rows"])
        assert "serial line" in facts(report, 2)["identity"]


@contextmanager
def examining(rig: Path, seconds: int) -> Iterator[subprocess.Popen[str]]:
    """An examination that has come to the arm."""
    words = command("doctor", "--rig", rig, "--seconds", seconds)
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline().startswith("rig: ")
            # Finding the modules at all their rates takes a while.
            time.sleep(5.0)
            yield process
        finally:
            process.kill()


def test_interrupted_and_unplugged(tmp_path: Path) -> None:
    with emulated(tmp_path) as (rig, emulator):
        for number in (signal.SIGINT, signal.SIGTERM):
            with examining(rig, 60) as process:
                process.send_signal(number)
                _, complaint = process.communicate(timeout=20)
                assert process.returncode == 130
                assert complaint.strip() == "palpate: stopped; every device is closed"
        # The arm's counters are kept when it is stopped, which is on the way out.
        assert rig.with_suffix(".counts.json").exists()
        # Somebody else may get the name of the sensor's pseudo-terminal once it is free.
        channel = RigFile.load(rig).force_sensor.settings["channel"]
        alone = tmp_path / "alone.toml"
        alone.write_text(rig.read_text().replace(f'"{channel}"', '"/dev/nowhere"'))
        with examining(alone, 9) as process:
            emulator.send_signal(signal.SIGINT)
            printed, complaint = process.communicate(timeout=60)
    assert (process.returncode, complaint) == (1, "")
    arm, sensor = printed.split("force sensor: ")
    assert "wrong" in arm
    assert "there is no /dev/nowhere" in sensor
