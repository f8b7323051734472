"""Parts and HTML for a report, which is a single self-contained file and needs no network."""

import base64
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

from palpate.adapters.experiments import TrialRow, exact_interval
from palpate.core.errors import OutputError

PAGE: Final = "report.html"
_GENERATOR: Final = b'<meta name="generator" content="palpate report">'


class Picture(NamedTuple):
    """A picture on the page."""

    alt: str
    caption: str
    png: bytes

    @property
    def source(self) -> str:
        """Return the picture as a data URI."""
        return f"data:image/png;base64,{base64.b64encode(self.png).decode('ascii')}"


class PageTable(NamedTuple):
    """A table on the page."""

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


class PageSection(NamedTuple):
    """A section on the page. ``listing`` is text that is initially collapsed."""

    title: str
    text: str = ""
    tables: tuple[PageTable, ...] = ()
    pictures: tuple[Picture, ...] = ()
    listing: str = ""


class Page(NamedTuple):
    """A report that begins with key data and important notices."""

    title: str
    kind: str
    facts: tuple[tuple[str, str], ...]
    sections: tuple[PageSection, ...]
    notices: tuple[str, ...] = ()


def html_of(page: Page, version: str) -> str:
    """Return the page as HTML."""
    # Imported here, because refusals do not need it.
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("palpate.adapters.visualisation.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("report.html.jinja").render(page=page, version=version)


def require_free(path: Path) -> None:
    """Check that the page would not replace a file that is not a report.

    Raises:
        OutputError: Such a file exists.
    """
    if not os.path.lexists(path):
        return
    if _GENERATOR not in path.read_bytes():
        raise OutputError(str(path), "was not made by palpate report", "move it away")


def success_of(rows: Sequence[TrialRow]) -> str:
    """Return the success rate with its exact 95 % confidence interval."""
    wins = sum(row.success for row in rows)
    low, high = exact_interval(wins, len(rows))
    return f"{wins / len(rows):.1%} [{low:.1%}, {high:.1%}]"
