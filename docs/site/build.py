"""Build the documentation site from the pages of docs/, README, examples, rig files and the public API.

    python -m docs.site.build            into runs/site; a broken link, or any other warning, is an error

The pages also work in the repository. On the site, links out of docs/ point to pages of the site; links to files
without a page become plain text if pyproject.toml names no repository. The navigation lists pages in the order in
which docs/README.md links to them.
"""

from __future__ import annotations

import argparse
import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import redirect_stdout
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from typing import Final

from docs.site.links import in_repository, relinked
from palpate.adapters.cli.settings import SettingsOptions, settings

ROOT: Final = Path(__file__).parents[2]
ROOTS: Final = ("core", "adapters", "drivers", "simulation")
MOVED: Final = {
    "README.md": "index.md",
    "docs/README.md": "contents.md",
    "docs/decisions/README.md": "decisions/index.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
    "examples": "examples/index.md",
}
"""Site paths that differ from the paths in docs/."""
START: Final = ("index.md", "tutorial.md", "contents.md", "examples/index.md")
REFERENCE: Final = ("commands.md", "settings.md", "job-file.md", "api.md", "glossary.md")
PROJECT: Final = ("changelog.md", "contributing.md", "security.md")
"""Pages in the Project section; pages that are in no other section are explanations."""
SHOWN: Final = ("examples/**/*.py", "examples/**/*.toml")


def sources() -> dict[str, str]:
    """Return the site path of every file that has a page; keys are paths in the repository."""
    pages = {
        str(path.relative_to(ROOT)): str(path.relative_to(ROOT / "docs")) for path in (ROOT / "docs").rglob("*.md")
    }
    for pattern in SHOWN:
        pages |= {name: f"{name}.md" for name in (str(path.relative_to(ROOT)) for path in ROOT.glob(pattern))}
    for path in (ROOT / "examples").rglob("*"):
        if path.is_dir():
            pages[str(path.relative_to(ROOT))] = "examples/index.md"
    return pages | {name: place for name, place in MOVED.items() if (ROOT / name).exists()}


def repository() -> str:
    """Return the repository address in pyproject.toml, or an empty string if it is not set."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    return str(project["tool"]["hatch"]["metadata"]["hooks"]["custom"]["repository"])


def linked(text: str, name: str, pages: dict[str, str], address: str) -> str:
    """Return the text of a page with its links rewritten for the site.

    Args:
        text: Markdown.
        name: Path of the page in the repository.
        pages: Result of `sources`.
        address: Result of `repository`.
    """
    here = os.path.dirname(pages[name]) or "."

    def place_of(path: str) -> str:
        if path in pages or path.startswith("docs/"):
            return os.path.relpath(pages.get(path, path.removeprefix("docs/")), here)
        return in_repository(address, path, picture=False)

    return relinked(text, name, place_of)


def public_modules() -> Iterator[tuple[str, list[str]]]:
    """Yield every public module with its public names.

    The names are those in its stub or, without a stub, all names without a leading underscore that it defines.
    """
    for root in ROOTS:
        top = ROOT / root / "palpate" / root
        for path in sorted({*top.rglob("__init__.pyi"), *top.glob("*.py"), *top.glob("gymnasium_envs/*.py")}):
            place = path.parent if path.stem == "__init__" else path.with_suffix("")
            module = ".".join(place.relative_to(ROOT / root).parts)
            body = ast.parse(path.read_text(encoding="utf-8")).body
            if path.suffix == ".pyi":
                names = [
                    one.asname or one.name for node in body if isinstance(node, ast.ImportFrom) for one in node.names
                ]
            else:
                names = [node.name for node in body if isinstance(node, (ast.ClassDef, ast.FunctionDef))]
                names += [ast.unparse(node.targets[0]) for node in body if isinstance(node, ast.Assign)]
            # A function with the name of its own module would otherwise be shown as that module.
            names = [f"{one}.{one}" if (path.parent / f"{one}.py").exists() else one for one in names]
            if names := [one for one in names if not one.startswith("_")]:
                yield module, names


def reference(pages: Path) -> list[str]:
    """Write one page per module, and return the site paths of the pages."""
    (pages / "reference").mkdir()
    written = []
    for module, names in public_modules():
        text = f"---\ntitle: {module.removeprefix('palpate.')}\n---\n\n# {module}\n\n"
        text += f"::: {module}\n    options:\n      members: false\n      show_root_heading: false\n"
        text += "      show_root_toc_entry: false\n\n"
        text += "\n".join(f"::: {module}.{name}\n" for name in sorted(names, key=str.lower))
        (pages / "reference" / f"{module}.md").write_text(text, encoding="utf-8")
        written.append(f"reference/{module}.md")
    return written


def in_order(pages: set[str]) -> list[str]:
    """Return pages in the order of the links in docs/README.md, followed by all others."""
    linked_pages = re.findall(r"\]\(([\w/-]+\.md)", (ROOT / "docs" / "README.md").read_text(encoding="utf-8"))
    order = {page: number for number, page in reversed(list(enumerate(linked_pages)))}
    return sorted(pages, key=lambda page: (order.get(page, len(linked_pages)), page))


def write_pages(pages: Path) -> list[dict[str, object]]:
    """Write all pages into an empty folder, and return the navigation."""
    shutil.copytree(ROOT / "docs", pages, ignore=shutil.ignore_patterns("site", "__pycache__", "README.md"))
    places, address = sources(), repository()
    for name, place in places.items():
        path = ROOT / name
        (pages / place).parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".md":
            text = linked(path.read_text(encoding="utf-8"), name, places, address)
            (pages / place).write_text(text, encoding="utf-8")
        elif path.is_file():
            language = path.suffix.removeprefix(".").replace("py", "python")
            text = path.read_text(encoding="utf-8")
            (pages / place).write_text(f"# `{name}`\n\n````{language}\n{text}````\n", encoding="utf-8")
    shown = sorted(place for name, place in places.items() if (ROOT / name).is_file() and not name.endswith(".md"))
    rows = "".join(f"- [`{place.removesuffix('.md')}`]({os.path.relpath(place, 'examples')})\n" for place in shown)
    begin = "# Examples\n\nThe source distribution also contains these files.\n\n"
    (pages / "examples" / "index.md").write_text(begin + rows, encoding="utf-8")
    (pages / "settings.md").write_text(settings_page(), encoding="utf-8")
    api: dict[str, list[object]] = {root: [] for root in ROOTS}
    for place in reference(pages):
        module = place.removesuffix(".md").removeprefix("reference/palpate.")
        api[module.partition(".")[0]].append({module: place})
    how_to = in_order({place for place in places.values() if place.startswith("how-to/")})
    decisions = sorted(place for place in places.values() if place.startswith("decisions/"))
    explanation = in_order(set(places.values()) - {*START, *how_to, *decisions, *shown, *REFERENCE, *PROJECT})
    return [
        {"Start": list(START)},
        {"How to": how_to},
        {"Explanation": explanation},
        {"Reference": [*REFERENCE, {"Packages": [{root: found} for root, found in api.items()]}]},
        {"Decisions": decisions},
        {"Project": list(PROJECT)},
        {"Files": [{place.removesuffix(".md"): place} for place in shown]},
    ]


def settings_page() -> str:
    """Return a page with the output of ``palpate settings`` for every group."""

    def printed(group: str) -> str:
        with redirect_stdout(StringIO()) as text:
            settings(SettingsOptions(group))
        return text.getvalue()

    groups = [line.split()[0] for line in printed("").splitlines()[1:]]
    title = "# Settings: all, with type, range, unit and default\n"
    return title + "".join(f"\n## {group}\n\n```text\n{printed(group)}```\n" for group in groups)


def toml(value: object) -> str:
    """Return a navigation value in TOML."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f'"{key}" = {toml(one)}' for key, one in value.items()) + " }"
    return "[" + ", ".join(map(toml, value)) + "]" if isinstance(value, list) else f'"{value}"'


def build(out: Path) -> int:
    """Rebuild the site in a folder, and return the exit code of the builder."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    nav = write_pages(out / "pages")
    settings = (ROOT / "docs" / "site" / "zensical.toml").read_text(encoding="utf-8")
    address = repository()
    facts = f"nav = {toml(nav)}\n" + (f'repo_url = "{address}"\n' if address else "")
    paths = "".join(f'"{ROOT / root}", ' for root in ROOTS)
    settings = settings.replace("[project]\n", f"[project]\n{facts}", 1)
    settings += f"\n[project.plugins.mkdocstrings.handlers.python]\npaths = [{paths}]\n"
    (out / "zensical.toml").write_text(settings, encoding="utf-8")
    shutil.copy(ROOT / "docs" / "site" / "palpate.css", out / "pages")
    words = [
        sys.executable,
        "-m",
        "zensical",
        "build",
        "--strict",
        "--clean",
        "--config-file",
        str(out / "zensical.toml"),
    ]
    code = subprocess.run(words, check=False).returncode
    for path in [] if code else [out / "html" / "search.json", *(out / "html" / "reference").rglob("index.html")]:
        text = re.sub(r":(?:attr|class|data|func|meth|mod):(?=<code>)", "", path.read_text(encoding="utf-8"))
        path.write_text(re.sub(r"<code>~[\w.]*\.(?=\w+</code>)", "<code>", text), encoding="utf-8")
    for name in [] if code else unshown(out / "html"):
        sys.stderr.write(f"{name} is a public name without an entry in the reference\n")
        code = 1
    return code


def unshown(html: Path) -> list[str]:
    """Return public names that are missing from the built reference."""
    texts = {
        module: (html / "reference" / module / "index.html").read_text(encoding="utf-8")
        for module, _ in public_modules()
    }
    entries = [(module, f"{module}.{name}") for module, names in public_modules() for name in names]
    return [entry for module, entry in entries if f'id="{entry}"' not in texts[module]]


def main() -> int:
    """Build the site from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "runs" / "site")
    out = parser.parse_args().out.resolve()
    if find_spec("zensical") is None or find_spec("mkdocstrings") is None:
        sys.stderr.write("the documentation site needs: pip install -c constraints.txt -e '.[docs]'\n")
        return 2
    return build(out)


if __name__ == "__main__":
    sys.exit(main())
