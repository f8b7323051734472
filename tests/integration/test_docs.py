"""What the documents show works: links lead somewhere, the tutorial runs, settings and options exist."""

import json
import re
import shlex
import sys
import tomllib
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import pytest

from docs.site.notebook import BEGIN, notebook_of
from palpate.adapters.cli.arguments import flags_of
from palpate.adapters.cli.commands import COMMANDS, GROUPS, options_of
from palpate.adapters.config import RunConfig, overlay
from tests.command_line import QUICK

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [*sorted(DOCS.rglob("*.md")), *sorted(ROOT.glob("*.md"))]


def blocks(page):
    """Fenced blocks of a page: language and lines."""
    found = re.findall(r"^```(\w*)\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    return [(language, text.splitlines()) for language, text in found]


@cache
def anchors(page):
    """What links can point at within a page."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    titles = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


OURS = ("palpate ", "python ", "pytest ", "make ")
"""Beginnings of lines that are about palpate; a shell's other words are not tried."""


def commands_in(page):
    """Commands of a page, whole and without comments."""
    for language, lines in blocks(page):
        text = "\n".join(lines).replace("\\\n", " ")
        for line in text.splitlines() if language == "sh" else []:
            if line := re.sub(r"\s+(#.*|&.*|> \S+)$", "", re.sub(r"\s+#.*$", "", line)).strip():
                if line.startswith(OURS):
                    yield line


def shape(line):
    """A line without its numbers: another machine may be a little quicker, or have other versions."""
    return " ".join(re.sub(r"\d[\d.]*", "#", line).split())


def test_every_link_leads_somewhere():
    lost = []
    for page in PAGES:
        for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
            if link.startswith(("http", "mailto")):
                continue
            name, _, anchor = link.partition("#")
            target = page if not name else page.parent / name
            if not target.exists() or (anchor and anchor not in anchors(target)):
                lost.append(f"{page.relative_to(ROOT)}: {link}")
    assert lost == []


def shortened(line):
    """The same command, but quick."""
    if line.startswith("palpate train"):
        return shlex.join([*shlex.split(line), *QUICK, "--trials", "2"])
    if line.startswith("palpate run --policy runs/paper"):
        return shlex.join([*shlex.split(line.replace("--trials 5", "--trials 2")), *QUICK])
    return line


@pytest.mark.nightly
def test_tutorial(palpate, tmp_path, monkeypatch):
    """Its notebook, cell by cell in this process; the page has the same text and commands."""
    written = (DOCS / "tutorial.ipynb").read_text(encoding="utf-8")
    assert written == notebook_of((DOCS / "tutorial.md").read_text(encoding="utf-8")), "python -m docs.site.notebook"
    shown = []
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(Image=bytes, display=shown.append))
    printed, short, what_ifs = "", False, 0
    names = {}

    def run(line):
        nonlocal printed, short, what_ifs
        quick = shortened(f"palpate {line}").removeprefix("palpate ")
        done = palpate(*shlex.split(quick))
        what_ifs += "--set" in line
        assert done.code == (1 if "--set" in line else 0), (line, done)
        assert "--set" not in line or "counterfactual from tick" in done.stdout
        printed, short = printed + done.stdout, short or quick != line

    for cell in json.loads(written)["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "code":
            printed = ""
            exec(compile(source, "tutorial.ipynb", "exec"), names)
            # The notebook's own way of calling a command is tried by its first cell alone.
            names["palpate"] = run if "palpate" in names and "def palpate" not in source else names["palpate"]
        for lines in re.findall(r"^```text\n(.*?)^```", source, re.DOTALL | re.MULTILINE) if printed else []:
            there = {shape(line) for line in printed.splitlines()}
            missing = [line for line in lines.splitlines() if shape(line) not in there]
            # After a shortened training other trials succeed, but the same lines are printed.
            assert len(missing) < len(lines.splitlines()) if short else missing == []
    assert what_ifs == 1
    assert len(shown) == 3
    assert all(picture.startswith((b"\x89PNG", b"GIF8")) for picture in shown)
    assert (tmp_path / "runs" / "used" / "report.html").is_file()


def test_notebook_without_what_it_needs_says_so_in_a_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "IPython", None)
    with pytest.raises(SystemExit, match=r"pip install 'palpate\[notebook\]' \(.*IPython"):
        exec(BEGIN, {})


def test_policies_of_ones_own(palpate, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS.parent / "examples" / "third_party_policies"))
    for language, lines in blocks(DOCS / "how-to" / "your-own-policy.md"):
        if language == "toml":
            (tmp_path / lines[0].removeprefix("# ")).write_text("\n".join(lines))
        for line in lines if language == "sh" else []:
            if line.startswith("palpate show"):
                table = palpate.succeed(*shlex.split(line)[1:])
                assert re.search(r"^x\+ y0 +programmed +-x ", table, re.MULTILINE)
                assert len(re.findall(r"^\S+ \S+ +programmed ", table, re.MULTILINE)) == 2
            elif "person" not in line:  # tests/cli/test_ask_a_person.py
                words = shlex.split(re.sub(r" --trials \d+", "", line))
                palpate.succeed(*words[1:], *QUICK, "--trials", 1, "--recording.no-enabled")
    assert "examples" in palpate.succeed("show", "runs/taught/policy.json")


@pytest.mark.parametrize(
    "page", [DOCS / "how-to" / "your-own-policy.md", DOCS / "commands.md"], ids=lambda page: page.stem
)
def test_settings_that_are_shown_are_settings(page):
    shown = [lines for language, lines in blocks(page) if language == "toml"]
    assert shown
    for lines in shown:
        overlay(RunConfig(), tomllib.loads("\n".join(lines)))


def test_every_shown_command_and_option_exists():
    lost = []
    for page in PAGES:
        for line in (line for line in commands_in(page) if line.startswith("palpate ")):
            words = line.split()
            name = " ".join(words[1:3]) if words[1] in GROUPS else words[1]
            has = name in COMMANDS and bool(COMMANDS[name].module)
            flags = {"--help", "--task", *(flags_of(options_of(name)) if has else ())}
            unknown = [word for word in words[2:] if word.startswith("--") and word not in flags]
            if unknown or (name not in COMMANDS and not name.startswith("--")):
                lost.append(f"{page.relative_to(ROOT)}: {line}: {unknown}")
    assert lost == []
