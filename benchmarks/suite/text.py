"""Figures as a table on the terminal, and as a section of a document."""

from __future__ import annotations

from math import floor, log10
from pathlib import Path

from benchmarks.suite.rows import Group, Row, Suite

BEGIN, END = "<!-- bench: begin -->", "<!-- bench: end -->"
BUSY = 1.0
"""Above this load other work counts."""
HEAD = ("figure", "measured", "floor or peer", "ratio")


def number(value: float) -> str:
    """Three digits that count, without powers of ten."""
    if value == 0.0:
        return "0"
    digits = max(2 - floor(log10(abs(value))), 0)
    return f"{value:.{digits}f}"


def cells(row: Row) -> tuple[str, str, str, str]:
    """What a row says, column by column."""
    against = f"{row.floor}: {number(row.floor_value)}" if row.floor_value is not None else row.floor
    ratio = "" if row.ratio is None else f"{row.ratio:.3f}" if row.ratio < 0.1 else f"{row.ratio:.2f}"
    return row.name, f"{number(row.value)} {row.unit}", against, ratio


def table(suite: Suite) -> str:
    """All figures, in columns."""
    parts = [f"{suite.form} form; {described(suite)}\n"]
    for group in suite.groups:
        parts.append(f"\n{group.title}  ({group.seconds:.0f} s)\n")
        if group.missing:
            parts.append(f"  not measured: {group.missing}\n")
            continue
        lines = [HEAD, *(cells(row) for row in group.rows)]
        widths = [max(len(line[column]) for line in lines) for column in range(len(HEAD))]
        for line in lines:
            told = "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True))
            parts.append(f"  {told}".rstrip() + "\n")
    return "".join(parts)


def section(suite: Suite) -> str:
    """The figures as a section of a Markdown document, without its marks."""
    how = "make bench" if suite.form == "quick" else "make bench-full"
    parts = [
        f"## All benchmarks, one run\n\n`{how}` wrote this section, the {suite.form} form."
        f" **Machine**: {described(suite)}. Ratios are value over floor or"
        " peer, both of this run; times without another word are CPU times.\n"
    ]
    for group in suite.groups:
        parts.append(f"\n**{group.title}.**" + (f" {group.notes}" if group.notes else "") + "\n")
        parts.append(_markdown(group))
    return "".join(parts)


def described(suite: Suite) -> str:
    """The machine in one sentence."""
    facts = [
        f"{name} {value}" if name not in ("processor", "memory", "system") else value
        for name, value in suite.machine.items()
    ]
    warning = " (busy: times are too long, and ratios less sure)" if suite.busy > BUSY else ""
    return f"{', '.join(facts)}; load at the beginning {suite.busy:.1f}{warning}"


def rewrite(path: Path, text: str) -> None:
    """Put a section between the marks of a document, and leave everything else as it is.

    A document without marks gets them, and the section, at its end.

    Raises:
        ValueError: Only one of the marks is there, or more than one pair, or the wrong way round.
    """
    before = path.read_text(encoding="utf-8")
    whole = f"{BEGIN}\n{text.rstrip()}\n{END}"
    counts = before.count(BEGIN), before.count(END)
    if counts == (0, 0):
        after = f"{before.rstrip()}\n\n{whole}\n"
    elif counts == (1, 1) and before.index(BEGIN) < before.index(END):
        after = before[: before.index(BEGIN)] + whole + before[before.index(END) + len(END) :]
    else:
        raise ValueError(f"{path}: {BEGIN} and {END} must be there once each, in this order")
    passing = path.with_name(f".{path.name}.part")
    passing.write_text(after, encoding="utf-8")
    passing.replace(path)


def _markdown(group: Group) -> str:
    if group.missing:
        return f"\nNot measured: {group.missing}.\n"
    lines = [HEAD, *(tuple(cell.replace("|", "/") for cell in cells(row)) for row in group.rows)]
    told = [f"| {' | '.join(line)} |" for line in lines]
    return "\n" + "\n".join([told[0], "|---|---|---|---|", *told[1:]]) + "\n"
