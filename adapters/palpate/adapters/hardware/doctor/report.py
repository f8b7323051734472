"""The report, for a person and for a program."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence
from dataclasses import asdict
from typing import Final

from palpate.adapters.hardware.doctor.findings import FindingsSection, FindingsTable, Level

_WIDTH: Final = 118
_MARK: Final = max(len(level.value) for level in Level)


def section_text(section: FindingsSection) -> str:
    """One section in aligned columns; a remedy stands below what it mends, behind ``->``."""
    lines = [section.title]
    names = max((len(fact.name) for fact in section.facts), default=0)
    for fact in section.facts:
        lines += _hanging(f"  {fact.name:{names}}  ", fact.text)
    for table in section.tables:
        lines += ["", *_table(table)]
    if section.findings:
        lines.append("")
    for finding in section.findings:
        lines += _hanging(f"  {finding.level.value:{_MARK}}  ", finding.text)
        if finding.remedy:
            lines += _hanging(f"  {'':{_MARK}}  -> ", finding.remedy)
    return "\n".join(lines) + "\n\n"


def summary_text(sections: Sequence[FindingsSection]) -> str:
    """The last line."""
    wrong, notes = _counts(sections)
    if not wrong:
        return f"all well, {_several(notes, 'note')}\n"
    return f"{_several(wrong, 'thing')} wrong, {_several(notes, 'note')}\n"


def report_json(rig: str, sections: Sequence[FindingsSection]) -> str:
    """Everything as one JSON object."""
    wrong, notes = _counts(sections)
    shown = [
        {
            **asdict(section),
            "findings": [{**asdict(finding), "level": finding.level.value} for finding in section.findings],
        }
        for section in sections
    ]
    return json.dumps({"rig": rig, "wrong": wrong, "notes": notes, "sections": shown}, indent=2) + "\n"


def _counts(sections: Sequence[FindingsSection]) -> tuple[int, int]:
    wrong, notes = [sum(section.count(level) for section in sections) for level in (Level.WRONG, Level.NOTE)]
    return wrong, notes


def _several(count: int, what: str) -> str:
    return f"{count} {what}" + ("" if count == 1 else "s")


def _hanging(head: str, text: str) -> list[str]:
    # Device names and commands must stay whole, to be copied.
    return textwrap.wrap(
        text, _WIDTH, initial_indent=head, subsequent_indent=" " * len(head), break_long_words=False,
        break_on_hyphens=False,
    )  # fmt: skip


def _table(table: FindingsTable) -> list[str]:
    cells = [table.columns, *table.rows]
    widths = [max(len(row[i]) for row in cells) for i in range(len(table.columns))]
    return ["  " + "  ".join(f"{cell:>{w}}" for cell, w in zip(row, widths, strict=True)) for row in cells]
