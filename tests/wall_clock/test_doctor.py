"""``palpate doctor`` on devices that ``palpate emulate`` serves from a process of its own: each kind of wire once."""

import json
import re
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import pytest

from tests.command_line import RT_EMULATOR, CommandLine, command, wait_until
from tests.wall_clock.host import Host, LateError

pytestmark = pytest.mark.usefixtures("real_time")

PATIENCE: Final = 4
"""Times the usual patience with a reply: what then is missing was lost, and did not only come late."""
ALLOWED_S: Final = 0.002
"""So late may a plain sleeper come on a host that is called in time."""
TIMING: Final = re.compile("do not fit|instead of|the adapter adds|readings come in clumps")
"""Findings about pace, which a late host explains. None about a reply that is lost, damaged or wrong is among them."""
SLOW = ("--divider", "4")
"""A cycle in which an emulator has time to compute on a processor that others slow down."""


@contextmanager
def emulated(folder: Path, *words: str) -> Iterator[Path]:
    """A rig file whose devices are served."""
    rig = folder / "rig.toml"
    call = command("emulate", "--rig-file", rig, *RT_EMULATOR, *SLOW, *words)
    with subprocess.Popen(call, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            wait_until(lambda: rig.exists() and "force_sensor" in rig.read_text(), process)
            rig.write_text(rig.read_text().replace("[arm]\n", f"[arm]\npatience = {PATIENCE}\n"))
            yield rig
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(timeout=20)


def examined(rig: Path, *words: str) -> dict[str, Any]:
    """The report."""
    done = CommandLine()("doctor", "--rig", rig, "--seconds", "1", "--json", *words)
    report: dict[str, Any] = json.loads(done.stdout)
    assert done.code == (1 if report["wrong"] else 0)
    return report


def wrongs(report: dict[str, Any]) -> list[str]:
    """What is wrong with arm and sensor.

    Raises:
        LateError: Nothing but the pace is, which is right to say of a host that comes late.
    """
    findings = [finding for section in report["sections"][1:] for finding in section["findings"]]
    told = [f"{f['text']} -> {f['remedy']}" for f in findings if f["level"] == "wrong"]
    others = [line for line in told if not TIMING.search(line)]
    if told and not others:
        raise LateError("; ".join(told))
    return others


def facts(report: dict[str, Any], section: int) -> dict[str, str]:
    return {fact["name"]: fact["text"] for fact in report["sections"][section]["facts"]}


def test_zebra_and_jr3_on_can(tmp_path: Path, host: Host) -> None:
    with emulated(tmp_path) as rig, host.judged(ALLOWED_S):
        report = examined(rig, "--move")
        arm, sensor = facts(report, 1), facts(report, 2)
        assert arm["modules"].startswith("6, ")
        assert arm["woken by us"].startswith("yes")
        assert "node 9" in sensor["identity"]
        (table,) = report["sections"][1]["tables"]
        assert [row[2] for row in table["rows"]] == ["off"] * 6
        assert wrongs(report) == []
        assert "the last joint follows" in [finding["text"] for finding in report["sections"][1]["findings"]]


def test_cia402_and_jr3_on_a_serial_line(tmp_path: Path, host: Host) -> None:
    with emulated(tmp_path, "--arm", "cia402", "--force", "jr3-uart") as rig, host.judged(ALLOWED_S):
        report = examined(rig)
        assert facts(report, 1)["drives"].startswith("6, nodes 1, 2, 3, 4, 5, 6")
        states, _ = report["sections"][1]["tables"]
        assert not any("enabled" in row[6] for row in states["rows"])
        assert "serial line" in facts(report, 2)["identity"]
        assert wrongs(report) == []
