"""A page as HTML and CSV, and into a folder that may hold something of somebody else's."""

import csv
import io
import os
from html.parser import HTMLParser
from pathlib import Path

import pytest

from palpate.adapters.visualisation.report.canvas import drawn
from palpate.adapters.visualisation.report.page import Page, PageSection, PageTable, Picture
from palpate.adapters.visualisation.report.placing import GENERATOR, csv_of, html_of, place, require_placeable
from palpate.core.errors import OutputError

EVIL = '<script>alert("1")</script> "\'&amp;'


class Reader(HTMLParser):
    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def png() -> bytes:
    with drawn(1.0, 2.0) as canvas:
        canvas.figure.add_subplot()
    return canvas.content


def page(text: str = "words") -> Page:
    picture = Picture("one", f"alt {text}", f"caption {text}", png())
    sections = (
        PageSection(
            f"title {text}", (text,), (PageTable(text, (text, "b"), ((text, "2"),)),), (picture,), listing=text
        ),
        PageSection("with nothing"),
    )
    return Page(text, text, ((text, text),), sections, ({"a": text, "b": None}, {"a": 1.5, "c": True}), (text,))


def test_names_of_all_kinds_stay_words() -> None:
    plain, evil = (Reader(html_of(page(text), "1")) for text in ("words", EVIL))
    assert [tag for tag, _ in evil.tags] == [tag for tag, _ in plain.tags]
    assert "script" not in {tag for tag, _ in evil.tags}
    assert EVIL in evil.words
    (alt,) = (attrs["alt"] for tag, attrs in evil.tags if tag == "img")
    assert alt == f"alt {EVIL}"


def test_csv() -> None:
    text = csv_of(page(EVIL))
    lines = list(csv.DictReader(io.StringIO(text)))
    assert lines == [{"a": EVIL, "b": "", "c": ""}, {"a": "1.5", "b": "", "c": "True"}]


PAGE = f'<meta name="generator" content="{GENERATOR}">'
FILES = {"a.png": b"a", "summary.csv": b"s"}


def put(folder: Path, files: dict[str, bytes] = FILES, *, overwrite: bool = False) -> None:
    place(folder, PAGE, files, overwrite=overwrite)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_report_again_without_what_it_no_longer_has(tmp_path: Path) -> None:
    put(tmp_path, {"a.png": b"a", "b.png": b"b"})
    put(tmp_path, {"a.png": b"new", "c.png": b"c"})
    assert names(tmp_path / "report") == ["a.png", "c.png", "contents.json"]
    assert (tmp_path / "report" / "a.png").read_bytes() == b"new"


def test_somebody_else_s_page_stays(tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text("<html>mine</html>")
    with pytest.raises(OutputError, match=r"report\.html: is there already"):
        put(tmp_path)
    assert names(tmp_path) == ["report.html"]
    assert (tmp_path / "report.html").read_text() == "<html>mine</html>"
    put(tmp_path, overwrite=True)
    assert (tmp_path / "report.html").read_text() == PAGE


def test_somebody_else_s_pictures_stay(tmp_path: Path) -> None:
    (tmp_path / "report").mkdir()
    for name in ("a.png", "notes.txt"):
        (tmp_path / "report" / name).write_bytes(b"mine")
    with pytest.raises(OutputError, match=r"report/a\.png: is there already"):
        put(tmp_path)
    assert names(tmp_path) == ["report"]
    assert (tmp_path / "report" / "a.png").read_bytes() == b"mine"
    put(tmp_path, overwrite=True)
    put(tmp_path, {})
    # What is not ours is neither replaced nor removed.
    assert (tmp_path / "report" / "notes.txt").read_bytes() == b"mine"
    assert names(tmp_path / "report") == ["contents.json", "notes.txt"]


@pytest.mark.parametrize("kind", ["folder", "link", "dangling"])
def test_a_page_that_is_no_file(tmp_path: Path, kind: str) -> None:
    other = tmp_path / "other"
    other.write_text(PAGE)
    page = tmp_path / "report.html"
    if kind == "folder":
        page.mkdir()
    else:
        page.symlink_to(other if kind == "link" else tmp_path / "nowhere")
    with pytest.raises(OutputError, match="in the way"):
        require_placeable(tmp_path, overwrite=True)


@pytest.mark.parametrize("kind", ["file", "link"])
def test_a_folder_that_is_none(tmp_path: Path, kind: str) -> None:
    (tmp_path / "other").mkdir()
    pictures = tmp_path / "report"
    pictures.touch() if kind == "file" else pictures.symlink_to(tmp_path / "other")
    with pytest.raises(OutputError, match="no folder"):
        put(tmp_path, overwrite=True)


def test_a_list_that_names_files_elsewhere_removes_none(tmp_path: Path) -> None:
    put(tmp_path)
    (tmp_path / "trials.csv").write_text("precious")
    (tmp_path / "report" / "contents.json").write_text(
        '{"schema": "palpate.report/1", "files": ["../trials.csv", "/etc/passwd", "..", "a.png", "summary.csv"]}'
    )
    put(tmp_path, {"c.png": b"c"})
    assert (tmp_path / "trials.csv").read_text() == "precious"
    assert names(tmp_path / "report") == ["c.png", "contents.json"]


@pytest.mark.parametrize("text", ["", "[]", '{"schema": "other", "files": ["a.png"]}', '{"schema": 1}'])
def test_without_a_list_nothing_is_ours(tmp_path: Path, text: str) -> None:
    put(tmp_path)
    (tmp_path / "report" / "contents.json").write_text(text)
    with pytest.raises(OutputError, match="not made by palpate report"):
        put(tmp_path)


def test_a_report_that_was_cut_short_is_still_ours(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    replace = os.replace

    def full(source: object, target: Path) -> None:
        if Path(target).name == "summary.csv":
            raise OSError(28, "No space left on device")
        replace(str(source), target)

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(OutputError, match="No space left"):
        put(tmp_path)
    monkeypatch.undo()
    assert names(tmp_path) == ["report"]
    assert names(tmp_path / "report") == ["a.png", "contents.json"]
    put(tmp_path)
    assert names(tmp_path / "report") == ["a.png", "contents.json", "summary.csv"]
