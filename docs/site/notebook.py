"""Convert docs/tutorial.md to the notebook docs/tutorial.ipynb, whose commands run in the process of the kernel.

python -m docs.site.notebook                   write docs/tutorial.ipynb
python -m docs.site.notebook --run OUT.ipynb   run the notebook in a kernel, and write it with outputs to OUT.ipynb
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

DOCS: Final = Path(__file__).parents[1]
BEGIN: Final = '''\
import shlex
from pathlib import Path

try:
    from IPython.display import Image, display

    from palpate.adapters.cli.main import main
except ModuleNotFoundError as error:
    raise SystemExit(f"this notebook needs its kernel to have: pip install 'palpate[notebook]' ({error})") from None


def palpate(line: str) -> None:
    """Run a palpate command in this process, and show an exit code other than 0."""
    if code := main(shlex.split(line)):
        display(f"exit code {code}")


def show(path: str) -> None:
    """Show a picture that a command has written."""
    display(Image(Path(path).read_bytes()))
'''
BLOCK: Final = re.compile(r"^```sh\n(.*?)^```\n", re.DOTALL | re.MULTILINE)
PICTURES: Final = (
    (re.compile(r"palpate log plot (\S+)\.mcap"), r"\1.png"),
    (re.compile(r"palpate render .*--to (\S+\.gif).*"), r"\1"),
    (re.compile(r"palpate train .*--out (\S+).*"), r"\1/learning_curve.png"),
)
"""Regular expressions of commands, each with the picture that the command writes."""


def code_of(block: str) -> Iterator[str]:
    """Yield Python lines for the palpate commands of a shell block, without other shell commands."""
    for line in block.splitlines():
        if line.startswith("palpate "):
            yield f"palpate({json.dumps(line.removeprefix('palpate '))})"
            yield from (f"show({json.dumps(how.sub(name, line))})" for how, name in PICTURES if how.fullmatch(line))


def cells_of(text: str) -> Iterator[tuple[str, str]]:
    """Yield kind and source of each cell: text cells for the text of the page, code cells for its commands."""
    place = 0
    for block in BLOCK.finditer(text):
        code = "\n".join(code_of(block.group(1)))
        shell = "".join(f"{line}\n" for line in block.group(1).splitlines() if not line.startswith("palpate "))
        yield "markdown", text[place : block.start()] + (f"```sh\n{shell}```\n" if shell else "")
        if not place:
            yield "code", BEGIN
        yield "code", code
        place = block.end()
    yield "markdown", text[place:]


def notebook_of(text: str) -> str:
    """Return the notebook (nbformat 4.5) of a page, without outputs. Identical pages produce identical bytes."""
    cells: list[dict[str, Any]] = []
    for number, (kind, source) in enumerate(cells_of(text)):
        cell = {"cell_type": kind, "id": f"cell-{number}", "metadata": {}, "source": source.strip().splitlines(True)}
        cells.append(cell | ({"execution_count": None, "outputs": []} if kind == "code" else {}))
    kernel = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return json.dumps({"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}, indent=1) + "\n"


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--run", type=Path)
    out = parser.parse_args().run
    text = notebook_of((DOCS / "tutorial.md").read_text(encoding="utf-8"))
    if out is None:
        (DOCS / "tutorial.ipynb").write_text(text, encoding="utf-8")
        return 0
    try:
        import nbclient
        import nbformat
    except ModuleNotFoundError:
        sys.stderr.write("running the notebook needs: pip install 'palpate[notebook]'\n")
        return 2
    notebook = nbformat.reads(text, as_version=4)
    try:
        nbclient.NotebookClient(notebook, timeout=1200, resources={"metadata": {"path": str(out.parent)}}).execute()
    finally:
        nbformat.write(notebook, out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
