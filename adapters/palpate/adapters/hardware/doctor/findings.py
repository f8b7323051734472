"""What an examination brings to light: facts, tables and findings, section by section."""

import enum
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palpate.adapters.log import aligned
from palpate.core.errors import ConfigurationError, PalpateError, told
from palpate.drivers.errors import DriverError


class Level(enum.Enum):
    """How bad it is."""

    OK = "ok"
    NOTE = "note"
    WRONG = "wrong"


@dataclass(frozen=True)
class Finding:
    """One judgement."""

    level: Level
    text: str
    remedy: str = ""

    def __post_init__(self) -> None:
        if self.level is Level.WRONG and not self.remedy:
            raise ValueError(f"no remedy for: {self.text}")


@dataclass(frozen=True)
class Fact:
    """Something measured or told, without a judgement."""

    name: str
    text: str


@dataclass(frozen=True)
class FindingsTable:
    """Facts that come once per axis or channel."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class FindingsSection:
    """All about one device.

    Attributes:
        tables: The same, per axis or channel.
    """

    title: str
    facts: tuple[Fact, ...] = ()
    tables: tuple[FindingsTable, ...] = ()
    findings: tuple[Finding, ...] = ()

    def count(self, level: Level) -> int:
        """Number of findings of that level."""
        return sum(finding.level is level for finding in self.findings)


def driver_error(error: BaseException) -> DriverError | None:
    """The driver's error behind an error of the core; None where there is none."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, DriverError):
        cause = cause.__cause__
    return cause


class Notebook:
    """Takes down a section while the examination goes on, so that what fails half way leaves what was found before."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._facts: list[Fact] = []
        self._tables: list[FindingsTable] = []
        self._findings: list[Finding] = []

    def fact(self, name: str, text: str) -> None:
        """Take down a fact."""
        self._facts.append(Fact(name, text))

    def table(self, columns: tuple[str, ...], rows: tuple[tuple[str, ...], ...]) -> None:
        """Take down a table."""
        self._tables.append(FindingsTable(columns, rows))

    def ok(self, text: str) -> None:
        """Something is as it should be."""
        self._findings.append(Finding(Level.OK, text))

    def note(self, text: str, remedy: str = "") -> None:
        """Something is worth knowing, or suspicious."""
        self._findings.append(Finding(Level.NOTE, text, remedy))

    def wrong(self, text: str, remedy: str) -> None:
        """Something is wrong."""
        self._findings.append(Finding(Level.WRONG, text, remedy))

    def judge(self, good: bool, well: str, ill: str, remedy: str) -> None:
        """Take down one of two findings."""
        if good:
            self.ok(well)
        else:
            self.wrong(ill, remedy)

    def error(self, error: Exception) -> None:
        """Take down an error; a driver's own words, where it has some, say how to mend it."""
        cause = driver_error(error)
        if cause is not None:
            self.wrong(f"{cause.device}: {cause.problem}", cause.remedy)
        elif isinstance(error, ConfigurationError):
            self.wrong(f"{error.field} = {error.value!r}", error.accepted)
        else:
            text = f"{type(error).__name__}: {str(error) or repr(error)}"
            self.wrong(text if isinstance(error, PalpateError) else told(error), "see the adapter's own documentation")

    @property
    def wrongs(self) -> int:
        """How many things are wrong so far."""
        return sum(finding.level is Level.WRONG for finding in self._findings)

    def section(self) -> FindingsSection:
        """All that was taken down."""
        return FindingsSection(self._title, tuple(self._facts), tuple(self._tables), tuple(self._findings))


_WIDTH: Final = 118
_MARK: Final = max(len(level.value) for level in Level)


def section_text(section: FindingsSection) -> str:
    """One section in aligned columns; a remedy stands below what it mends, behind ``->``."""
    lines = [section.title]
    names = max((len(fact.name) for fact in section.facts), default=0)
    for fact in section.facts:
        lines += _hanging(f"  {fact.name:{names}}  ", fact.text)
    for table in section.tables:
        lines += ["", *(f"  {row}" for row in aligned([table.columns, *table.rows], left=0).splitlines())]
    if section.findings:
        lines.append("")
    for finding in section.findings:
        lines += _hanging(f"  {finding.level.value:{_MARK}}  ", finding.text)
        if finding.remedy:
            lines += _hanging(f"  {'':{_MARK}}  -> ", finding.remedy)
    return "\n".join(lines) + "\n\n"


def summary_text(sections: Sequence[FindingsSection]) -> str:
    """The last line."""
    wrong, notes = [sum(section.count(level) for section in sections) for level in (Level.WRONG, Level.NOTE)]
    if not wrong:
        return f"all well, {_several(notes, 'note')}\n"
    return f"{_several(wrong, 'thing')} wrong, {_several(notes, 'note')}\n"


def _several(count: int, what: str) -> str:
    return f"{count} {what}" + ("" if count == 1 else "s")


def _hanging(head: str, text: str) -> list[str]:
    # Device names and commands must stay whole, to be copied.
    return textwrap.wrap(
        text, _WIDTH, initial_indent=head, subsequent_indent=" " * len(head), break_long_words=False,
        break_on_hyphens=False,
    )  # fmt: skip
