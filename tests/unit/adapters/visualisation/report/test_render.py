"""The page as HTML: nothing outside it, nothing in it that somebody's names could break."""

from __future__ import annotations

import base64
import csv
import io
from html.parser import HTMLParser

from palpate.adapters.visualisation.report.canvas import drawn
from palpate.adapters.visualisation.report.page import Page, PageSection, PageTable, Picture
from palpate.adapters.visualisation.report.render import GENERATOR, csv_of, html_of

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
    return canvas.png


def page(text: str = "words") -> Page:
    picture = Picture("one", f"alt {text}", f"caption {text}", png())
    sections = (
        PageSection(
            f"title {text}", (text,), (PageTable(text, (text, "b"), ((text, "2"),)),), (picture,), listing=text
        ),
        PageSection("with nothing"),
    )
    return Page(text, text, ((text, text),), (text,), sections, ({"a": text, "b": None}, {"a": 1.5, "c": True}))


def test_names_of_all_kinds_stay_words() -> None:
    plain, evil = (Reader(html_of(page(text), "1")) for text in ("words", EVIL))
    assert [tag for tag, _ in evil.tags] == [tag for tag, _ in plain.tags]
    assert "script" not in {tag for tag, _ in evil.tags}
    assert EVIL in evil.words
    (alt,) = (attrs["alt"] for tag, attrs in evil.tags if tag == "img")
    assert alt == f"alt {EVIL}"


def test_pictures_are_inside() -> None:
    (image,) = (attrs for tag, attrs in Reader(html_of(page(), "1")).tags if tag == "img")
    source = image["src"]
    assert source is not None
    head, _, body = source.partition(",")
    assert head == "data:image/png;base64"
    assert base64.b64decode(body) == page().pictures[0].png
    assert (image["width"], image["height"]) == ("300", "150")


def test_sections_without_anything_are_left_out() -> None:
    html = html_of(page(), "1")
    assert "title words" in html
    assert "with nothing" not in html


def test_a_page_is_known_as_ours_from_its_beginning() -> None:
    assert f'content="{GENERATOR}"' in html_of(page(), "1")[:400]


def test_csv() -> None:
    text = csv_of(page(EVIL))
    lines = list(csv.DictReader(io.StringIO(text)))
    assert lines == [{"a": EVIL, "b": "", "c": ""}, {"a": "1.5", "b": "", "c": "True"}]
