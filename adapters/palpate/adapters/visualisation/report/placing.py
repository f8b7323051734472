"""From a page to HTML and CSV, and into its folder, where nothing that is not ours is overwritten."""

import base64
import json
import os
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from jinja2 import Environment, PackageLoader, StrictUndefined

from palpate.adapters.log import csv_text
from palpate.adapters.visualisation.report.files import is_there, read_bytes
from palpate.adapters.visualisation.report.page import Page, Picture
from palpate.core.errors import OutputError
from palpate.core.ports import write_whole

GENERATOR: Final = "palpate report 1"
"""The mark of a page that palpate made."""


def html_of(page: Page, version: str) -> str:
    """The page as one HTML file that needs nothing else."""
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
    columns = list(dict.fromkeys(name for row in page.summary for name in row))
    return csv_text([columns, *([row.get(name) for name in columns] for row in page.summary)])


def _data_uri(picture: Picture) -> str:
    return f"data:image/png;base64,{base64.b64encode(picture.png).decode('ascii')}"


def _size(picture: Picture) -> tuple[int, int]:
    """Width and height in pixels, from the header of the PNG file."""
    width, height = struct.unpack(">II", picture.png[16:24])
    return width, height


PAGE: Final = "report.html"
FOLDER: Final = "report"
CONTENTS: Final = "contents.json"
"""In the folder of pictures: the names of the files that are ours."""
_SCHEMA: Final = "palpate.report/1"
_HEAD_BYTES: Final = 2048
_REMEDY: Final = "move it away, or replace it with --overwrite"


def require_placeable(folder: Path, *, overwrite: bool) -> None:
    """Make sure before any work is done that no page and no folder of somebody else's is in the way.

    Raises:
        OutputError: Something is in the way.
    """
    page, pictures = folder / PAGE, folder / FOLDER
    if os.path.lexists(page):
        if os.path.islink(page) or not os.path.isfile(page):
            raise OutputError(str(page), "is in the way and is no file", "move it away")
        if not overwrite and f'content="{GENERATOR}"'.encode() not in read_bytes(page)[:_HEAD_BYTES]:
            raise OutputError(str(page), "is there already and was not made by palpate report", _REMEDY)
    if os.path.lexists(pictures) and (os.path.islink(pictures) or not os.path.isdir(pictures)):
        raise OutputError(str(pictures), "is in the way and is no folder", "move it away")


def place(folder: Path, page: str, files: Mapping[str, bytes], *, overwrite: bool) -> None:
    """Write ``report.html``, and the other files into the folder ``report``.

    Each file is whole or not there, the page comes last, and files of an older report that this one does not have are
    removed. Files of somebody else's stay.

    Raises:
        OutputError: A file of somebody else's is in the way, or something cannot be written.
    """
    require_placeable(folder, overwrite=overwrite)
    pictures = folder / FOLDER
    ours = _ours(pictures)
    for name in sorted({*files, CONTENTS}):
        path = pictures / name
        if os.path.isdir(path):
            raise OutputError(str(path), "is in the way and is no file", "move it away")
        if os.path.lexists(path) and name not in ours and not overwrite:
            raise OutputError(str(path), "is there already and was not made by palpate report", _REMEDY)
    try:
        pictures.mkdir(exist_ok=True)
        # Claimed before they are there: a report that was cut short is still known as ours.
        write_whole(pictures / CONTENTS, _contents({*files, *ours}))
        for name, content in files.items():
            write_whole(pictures / name, content)
        write_whole(folder / PAGE, page)
        for name in sorted(ours - {*files, CONTENTS}):
            if not os.path.isdir(pictures / name):
                (pictures / name).unlink(missing_ok=True)
        write_whole(pictures / CONTENTS, _contents(files))
    except OSError as error:
        raise OutputError(str(folder), f"cannot be written to ({error.strerror})", "mend that and try again") from error


def _ours(pictures: Path) -> set[str]:
    """Names of the files that an older report of ours left there."""
    path = pictures / CONTENTS
    if not is_there(path):
        return set()
    try:
        content = json.loads(read_bytes(path))
        names = content["files"] if content["schema"] == _SCHEMA else []
        # Names in the folder itself only: what is removed is in the list.
        return {CONTENTS, *(name for name in names if Path(name).name == name)} if names else set()
    except (ValueError, KeyError, TypeError):
        return set()


def _contents(names: Mapping[str, bytes] | set[str]) -> bytes:
    return (json.dumps({"schema": _SCHEMA, "files": sorted({*names} - {CONTENTS})}, indent=1) + "\n").encode()
