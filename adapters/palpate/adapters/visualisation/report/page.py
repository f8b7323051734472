"""What a report consists of, before it is HTML."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

Cell: TypeAlias = str | int | float | bool | None


@dataclass(frozen=True)
class Picture:
    """A picture of the page, which is also a file beside it.

    Attributes:
        name: The file's name without its ending; unique in a report.
        wide: Keeps its size on narrow screens, where it can be moved sideways; for pictures with small letters.
    """

    name: str
    alt: str
    caption: str
    png: bytes
    wide: bool = False


@dataclass(frozen=True)
class PageTable:
    """A table of the page."""

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class PageSection:
    """A part of the page.

    Attributes:
        listing: A text file, shown folded; empty if there is none.
    """

    title: str
    text: tuple[str, ...] = ()
    tables: tuple[PageTable, ...] = ()
    pictures: tuple[Picture, ...] = ()
    listing: str = ""


@dataclass(frozen=True)
class Page:
    """A report.

    Attributes:
        notices: What a reader must know before believing anything: unfinished cells, early ends.
        summary: Rows of ``summary.csv``, all with the same columns.
    """

    title: str
    kind: str
    facts: tuple[tuple[str, str], ...]
    sections: tuple[PageSection, ...]
    summary: tuple[dict[str, Cell], ...]
    notices: tuple[str, ...] = ()

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """All pictures, in order."""
        return tuple(picture for section in self.sections for picture in section.pictures)


def shown_facts(facts: Sequence[tuple[str, object]]) -> tuple[tuple[str, str], ...]:
    """Names and values for people, without those that have none."""
    return tuple((name, str(value)) for name, value in facts if value not in (None, ""))


def counted(number: int, noun: str, plural: str = "") -> str:
    """A number with its noun: ``1 trial``, ``2 trials``."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def listed(names: Sequence[str], most: int = 5) -> str:
    """Names in a row, the rest counted."""
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")


def share(value: float) -> str:
    """A share as whole per cent: never 100 % or 0 % when it is not quite."""
    if 0.0 < value < 0.005:
        return "< 1 %"
    return "> 99 %" if 0.995 <= value < 1.0 else f"{value:.0%}".replace("%", " %")
