"""Words of a page."""

from __future__ import annotations

import pytest

from palpate.adapters.visualisation.report.page import Page, PageSection, Picture, counted, listed, share


@pytest.mark.parametrize(
    ("number", "words", "text"),
    [
        (1, ("cell",), "1 cell"),
        (0, ("cell",), "0 cells"),
        (2, ("state was", "states were"), "2 states were"),
        (1, ("state was", "states were"), "1 state was"),
    ],
)
def test_numbers_agree_with_their_nouns(number: int, words: tuple[str, ...], text: str) -> None:
    assert counted(number, *words) == text


def test_long_lists_are_cut_and_say_so() -> None:
    assert listed(["a", "b"]) == "a, b"
    assert listed(list("abcdefgh"), 5) == "a, b, c, d, e and 3 more"


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0 %"), (1.0, "100 %"), (0.5, "50 %"), (0.9999, "> 99 %"), (0.0001, "< 1 %"), (0.994, "99 %")],
)
def test_a_share_is_all_or_nothing_only_if_it_is(value: float, text: str) -> None:
    assert share(value) == text


def test_pictures_of_all_sections_in_order() -> None:
    a, b, c = (Picture(name, "alt", "caption", b"") for name in "abc")
    page = Page(
        "t", "k", (), (), (PageSection("1", pictures=(a,)), PageSection("2"), PageSection("3", pictures=(b, c))), ()
    )
    assert page.pictures == (a, b, c)
