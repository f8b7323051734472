"""From a page to HTML and CSV."""

from __future__ import annotations

import base64
import csv
import io
import struct
from typing import Final

from jinja2 import Environment, PackageLoader, StrictUndefined

from palpate.adapters.visualisation.report.page import Page, Picture

GENERATOR: Final = "palpate report 1"
"""By this a page is known as ours."""


def html_of(page: Page, version: str) -> str:
    """The page as one HTML file that needs nothing else.

    Args:
        page: The page.
        version: Version of palpate, for the foot.
    """
    environment = Environment(
        loader=PackageLoader("palpate.adapters.visualisation.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["data_uri"] = _data_uri
    environment.filters["size"] = _size
    # Sections that this folder has nothing for.
    sections = [s for s in page.sections if s.text or s.tables or s.pictures or s.listing]
    template = environment.get_template("report.html.jinja")
    return template.render(page=page, sections=sections, generator=GENERATOR, version=version)


def csv_of(page: Page) -> str:
    """The page's summary as CSV; an empty cell where there is no value."""
    text = io.StringIO()
    columns = list(dict.fromkeys(name for row in page.summary for name in row))
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(page.summary)
    return text.getvalue()


def _data_uri(picture: Picture) -> str:
    return f"data:image/png;base64,{base64.b64encode(picture.png).decode('ascii')}"


def _size(picture: Picture) -> tuple[int, int]:
    """Width and height in pixels, from the header of the PNG file."""
    width, height = struct.unpack(">II", picture.png[16:24])
    return width, height
