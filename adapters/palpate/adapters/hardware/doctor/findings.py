"""What an examination finds: facts and judgements, device by device."""

import enum
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from palpate.core.errors import ConfigurationError, PalpateError, told
from palpate.drivers.errors import DriverError

_WIDTH: Final = 118


class Level(enum.Enum):
    """How bad a finding is."""

    OK = "ok"
    NOTE = "note"
    WRONG = "wrong"


class Topic(enum.Enum):
    """Code of a finding; docs/how-to/doctor-findings.md has a section for each."""

    CLOCK = "clock"
    OPEN = "open"
    FAULT = "fault"
    RATE = "rate"
    SAMPLES = "samples"
    RANGE = "range"
    NOISE = "noise"
    FACTS = "facts"
    JOINTS = "joints"
    LIMITS = "limits"
    MODEL = "model"
    PUSH = "push"
    SIGN = "sign"
    AXES = "axes"
    MOVE = "move"


@dataclass(frozen=True)
class Finding:
    """One judgement: a sentence that ends, unless all is well, with what to do."""

    level: Level
    topic: Topic
    text: str


class DeviceReport:
    """Collects what is found about one device, so that a failure half way leaves what was found before.

    Attributes:
        facts: What was measured or reported, without a judgement.
        findings: Judgements, in the order in which they were made.
    """

    def __init__(self, title: str) -> None:
        self.title = title
        self.facts: dict[str, str] = {}
        self.findings: list[Finding] = []

    def add(self, level: Level, topic: Topic, text: str, remedy: str = "") -> None:
        """Add a finding.

        Raises:
            ValueError: Something is wrong and no remedy is given.
        """
        if level is Level.WRONG and not remedy:
            raise ValueError(f"no remedy for: {text}")
        self.findings.append(Finding(level, topic, f"{text}: {remedy}" if remedy else text))

    def judge(self, topic: Topic, good: bool, text: str, remedy: str, ill: Level = Level.WRONG) -> None:
        """Add a finding that is ok, or ill with its remedy."""
        self.add(Level.OK if good else ill, topic, text, "" if good else remedy)

    def error(self, error: Exception) -> None:
        """Add an error; a driver's error brings its own remedy."""
        cause: BaseException | None = error
        while cause is not None and not isinstance(cause, DriverError):
            cause = cause.__cause__
        if isinstance(cause, DriverError):
            self.add(Level.WRONG, Topic.OPEN, f"{cause.device}: {cause.problem}", cause.remedy)
        elif isinstance(error, ConfigurationError):
            self.add(Level.WRONG, Topic.OPEN, f"{error.field} = {error.value!r} is refused", error.accepted)
        else:
            ours = isinstance(error, PalpateError)
            remedy = "check cable and power, then examine it again" if ours else "see the adapter's own documentation"
            self.add(Level.WRONG, Topic.OPEN, str(error) if ours else told(error), remedy)

    def include(self, diagnostics: Mapping[str, str]) -> None:
        """Add what a driver reports of itself; its entry ``fault`` is a finding."""
        found = dict(diagnostics)
        fault = found.pop("fault", "")
        self.facts |= found
        if fault:
            self.add(Level.WRONG, Topic.FAULT, fault, "remove its cause, then examine the rig again")

    def count(self, level: Level) -> int:
        """Return the number of findings of a level."""
        return sum(finding.level is level for finding in self.findings)

    def text(self) -> str:
        """Return facts and findings in aligned columns."""
        lines = [self.title]
        wide = max(map(len, self.facts), default=0)
        for name, value in self.facts.items():
            lines += _hanging(f"  {name:{wide}}  ", value)
        for finding in self.findings:
            lines += _hanging(f"  {finding.level.value:5}  {finding.topic.value:7}  ", finding.text)
        return "\n".join((*lines, "", ""))


def summary_text(reports: Sequence[DeviceReport]) -> str:
    """Return the last line: how many things are wrong."""
    wrong, notes = (sum(report.count(level) for report in reports) for level in (Level.WRONG, Level.NOTE))
    return f"{f'{wrong} wrong' if wrong else 'all well'}, {notes} to note\n"


def _hanging(head: str, text: str) -> list[str]:
    # Device names and commands stay whole, to be copied.
    return textwrap.wrap(
        text, _WIDTH, initial_indent=head, subsequent_indent=" " * len(head), break_long_words=False,
        break_on_hyphens=False,
    )  # fmt: skip
