"""The fields on the page about job files are those that are declared: ``PALPATE_SNAPSHOT=write`` writes them again."""

import os
import runpy
from pathlib import Path

from palpate.adapters.config import texts_of
from palpate.core.job import JOB_TABLES, STATED, Job
from palpate.core.ports import accepted_by, kinds_of

PAGE = Path(__file__).parents[4] / "docs" / "job-file.md"
BEGIN, END = "<!-- fields -->\n", "<!-- end of fields -->\n"


def fields():
    lines = []
    for name in JOB_TABLES:
        table = getattr(Job(), name)
        lines += [f"| `[{name}]` | accepted | default | |", "|---|---|---|---|"]
        for field, kind in kinds_of(type(table)).items():
            stated = field in STATED.get(name, ())
            value = getattr(table, field)
            shown = "" if stated else f"`{list(value) if isinstance(value, tuple) else value}`"
            accepted = accepted_by(kind).removeprefix("a number ")
            key = f"**`{field}`**" if stated else f"`{field}`"
            lines.append(f"| {key} | {accepted} | {shown} | {texts_of(type(table))[field]} |")
        lines.append("")
    return "\n".join(lines[:-1]) + "\n"


def test_the_page_lists_every_field_as_it_is_declared():
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    listed, _, after = rest.partition(END)
    if os.environ.get("PALPATE_SNAPSHOT") == "write":
        listed = fields()
        PAGE.write_text(f"{before}{BEGIN}{listed}{END}{after}", encoding="utf-8")
    assert listed == fields()


def test_the_example_on_the_page_runs(tmp_path, monkeypatch):
    text = PAGE.read_text(encoding="utf-8")
    script = tmp_path / "example.py"
    script.write_text(text.partition("```python\n")[2].partition("```")[0], encoding="utf-8")
    monkeypatch.chdir(PAGE.parents[1])
    runpy.run_path(str(script))
