"""The documentation site's pages before they are built, and what a package index shows; ``make docs`` builds it."""

import re
import sys

import pytest

from docs.site import build
from docs.site.links import in_repository, relinked
from docs.site.vocabulary import found


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """All pages, and the navigation as TOML."""
    folder = tmp_path_factory.mktemp("site") / "pages"
    nav = build.write_pages(folder)
    return folder, build.toml(nav)


def test_every_page_is_in_the_navigation_and_every_link_leads_to_one(pages):
    folder, nav = pages
    written = sorted(folder.rglob("*.md"))
    assert len(written) > 90
    assert nav.index("tutorial.md") < nav.index("how-to/choose-a-learner.md") < nav.index("how-to/commission-a-rig.md")
    lost = []
    for page in written:
        assert f'"{page.relative_to(folder)}"' in nav, page
        for link in re.findall(r"\]\(([^)#\s]+)", re.sub(r"^```.*?^````?$", "", page.read_text(), flags=re.S | re.M)):
            if not re.match("[a-z]+:", link) and not (page.parent / link).is_file():
                lost.append((page.name, link))
    assert lost == []


@pytest.mark.parametrize("address", ["", "https://code.example/palpate"])
def test_links_follow_the_one_setting(address):
    text = "![a](docs/a.png) [b](docs/b.md#c) [d](#e) [f](https://g)\n```md\n[h](i.md)\n```\n"
    led = relinked(text, "README.md", lambda path: in_repository(address, path, picture=path.endswith("png")))
    blob = f"[b]({address}/blob/main/docs/b.md#c)" if address else "b"
    picture = f"![a]({address}/raw/main/docs/a.png)" if address else ""
    assert led == f"{picture} {blob} [d](#e) [f](https://g)\n```md\n[h](i.md)\n```\n"


def test_without_the_extra_one_line_says_what_to_install(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(build, "find_spec", lambda name: None)
    monkeypatch.setattr(sys, "argv", ["build", "--out", str(tmp_path / "site")])
    assert build.main() == 2
    assert "pip install -c constraints.txt -e '.[docs]'" in capsys.readouterr().err
    assert not (tmp_path / "site").exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("It is\ntold `anew` so.", [(2, "told")]),
        ("```\ntold\n```\nAnew, [nobody](other-frameworks.md)", [(4, "Anew"), (4, "nobody")]),
        ("The manifold reports it.", []),
    ],
)
def test_odd_word_is_found_outside_code_and_addresses(text, words):
    assert [(line, word) for line, word, _ in found(text)] == words
