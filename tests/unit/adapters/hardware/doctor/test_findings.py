from pathlib import Path

import pytest

from palpate.adapters.hardware.doctor import DeviceReport, Level, summary_text
from palpate.adapters.hardware.doctor.findings import Topic
from palpate.adapters.hardware.errors import translating
from palpate.core.errors import PalpateError
from palpate.drivers.errors import SilentError

DOCS = Path(__file__).parents[5] / "docs" / "how-to" / "doctor-findings.md"


def test_columns_are_aligned_and_names_stay_whole() -> None:
    report = DeviceReport("arm: some")
    report.include({"rate": "70 Hz", "a longer name": "word " * 40, "fault": "motor 3: overcurrent"})
    report.add(Level.WRONG, Topic.OPEN, "no such port", "find /dev/a-very-long-name-that-must-stay-whole")
    lines = report.text().splitlines()
    assert lines[:2] == ["arm: some", "  rate           70 Hz"]
    assert "  wrong  fault    motor 3: overcurrent: remove its cause, then examine the rig again" in lines
    assert "  wrong  open     no such port: find /dev/a-very-long-name-that-must-stay-whole" in lines
    assert all(len(line) <= 118 for line in lines)
    assert summary_text([report]) == "2 wrong, 0 to note\n"


def test_what_is_wrong_has_a_remedy() -> None:
    with pytest.raises(ValueError, match="no remedy for: a"):
        DeviceReport("arm").add(Level.WRONG, Topic.OPEN, "a")


def test_a_driver_speaks_for_itself() -> None:
    report = DeviceReport("arm")
    try:
        with translating("arm"):
            raise SilentError("drive 3", "is silent", "plug it in")
    except PalpateError as error:
        report.error(error)
    report.error(KeyError("port"))
    first, second = report.findings
    assert first.text == "drive 3: is silent: plug it in"
    assert second.text.startswith("KeyError: 'port'")


def test_every_code_is_on_the_page() -> None:
    text = DOCS.read_text()
    missing = [topic.value for topic in Topic if f"| `{topic.value}` |" not in text]
    assert not missing
