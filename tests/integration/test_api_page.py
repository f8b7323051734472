"""The page of the Python API: every example runs, and passes ``mypy --strict``; every name on it is there."""

import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
EXAMPLES = [re.findall(r"```python\n(.*?)```", text, re.DOTALL)[0] for text in PAGE.split("\n## ")[1:]]
TABLE = [re.findall(r"`(palpate[\w.]+)`: (.*)", line) for line in PAGE.splitlines() if line.startswith("|")]


@pytest.mark.nightly
def test_examples_run_one_after_the_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("examples").symlink_to(ROOT / "examples")
    for number, example in enumerate(EXAMPLES):
        exec(compile(example, f"example {number + 1}", "exec"), {"__name__": f"example_{number}"})


@pytest.mark.nightly
def test_examples_are_typed(tmp_path):
    for number, example in enumerate(EXAMPLES):
        (tmp_path / f"example_{number}.py").write_text(example, encoding="utf-8")
    # In the project's folder, so that what make lint has found out about the sources is not found out again.
    words = ["--strict", "--config-file", str(ROOT / "pyproject.toml"), *map(str, sorted(tmp_path.glob("*.py")))]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *words], cwd=ROOT, env=os.environ, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("line", [pair for pairs in TABLE for pair in pairs], ids=lambda pair: pair[0])
def test_every_name_on_the_page_is_there(line):
    module, names = import_module(line[0]), re.findall(r"`(\w+)`", line[1].split(";")[0])
    assert [name for name in names if not hasattr(module, name)] == []
