"""Results of a check: facts and findings for each device."""

import enum
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from palpate.core.errors import PalpateError, describe


class Level(enum.Enum):
    """Severity of a finding."""

    OK = "ok"
    NOTE = "note"
    WRONG = "wrong"


class Topic(enum.Enum):
    """Finding code; docs/how-to/doctor-findings.md has a row for each."""

    CLOCK = "clock"
    OPEN = "open"
    FAULT = "fault"
    RATE = "rate"
    SAMPLES = "samples"
    NOISE = "noise"
    FACTS = "facts"
    JOINTS = "joints"
    LIMITS = "limits"
    MODEL = "model"
    PUSH = "push"
    SIGN = "sign"
    AXES = "axes"
    MOVE = "move"


class Finding(NamedTuple):
    """A one-sentence finding, which ends with a remedy unless everything is in order."""

    level: Level
    topic: Topic
    text: str


class DeviceReport:
    """Facts and findings for one device. Earlier results are kept after a failure."""

    def __init__(self, title: str) -> None:
        self.title = title
        self.facts: dict[str, str] = {}
        self.findings: list[Finding] = []

    def add(self, level: Level, topic: Topic, text: str, remedy: str = "") -> None:
        """Add a finding."""
        self.findings.append(Finding(level, topic, f"{text}: {remedy}" if remedy else text))

    def judge(self, topic: Topic, good: bool, text: str, remedy: str, ill: Level = Level.WRONG) -> None:
        """Add an OK finding if ``good`` is true; otherwise add a finding of level ``ill`` with its remedy."""
        self.add(Level.OK if good else ill, topic, text, "" if good else remedy)

    def error(self, error: Exception) -> None:
        """Add an error. palpate's errors name the accepted values; a third-party adapter may raise any error."""
        if isinstance(error, PalpateError):
            self.add(Level.WRONG, Topic.OPEN, str(error))
        else:
            self.add(Level.WRONG, Topic.OPEN, describe(error), "see the adapter's own documentation")

    def include(self, diagnostics: Mapping[str, str]) -> None:
        """Add a driver's diagnostics. A ``fault`` entry becomes a finding."""
        found = dict(diagnostics)
        fault = found.pop("fault", "")
        self.facts |= found
        if fault:
            self.add(Level.WRONG, Topic.FAULT, fault, "remove its cause, then examine the rig again")

    def count(self, level: Level) -> int:
        """Return the number of findings at a level."""
        return sum(finding.level is level for finding in self.findings)

    def text(self) -> str:
        """Return the title, one line per fact and one line per finding."""
        wide = max(map(len, self.facts), default=0)
        facts = (f"  {name:{wide}}  {value}" for name, value in self.facts.items())
        findings = (f"  {level.value:5}  {topic.value:7}  {text}" for level, topic, text in self.findings)
        return "\n".join((self.title, *facts, *findings, "", ""))


def summary_text(reports: Sequence[DeviceReport]) -> str:
    """Return the final line, which gives the number of problems."""
    wrong, notes = (sum(report.count(level) for report in reports) for level in (Level.WRONG, Level.NOTE))
    return f"problems: {wrong}, notes: {notes}\n"
