"""The page of ``palpate infer``: the automaton, and how it was found."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from palpate.adapters.visualisation.report.automaton_section import automaton_section
from palpate.adapters.visualisation.report.files import is_there, read_json, read_png
from palpate.adapters.visualisation.report.page import Page, PageSection, PageTable, Picture, shown_facts
from palpate.core.automata import load, shown_name
from palpate.core.errors import OutputError

_COLUMNS = ("q", "raw_states", "states", "wrong", "agreement", "loss")


def infer_page(folder: Path, title: str, *, logs: bool) -> Page:
    """Put together the page of an inference."""
    machine = load(folder / "automaton.json")
    path = folder / "report.json"
    report = read_json(path)
    try:
        rows: list[dict[str, Any]] = [{name: entry[name] for name in _COLUMNS} for entry in report["by_q"]]
    except (KeyError, TypeError) as error:
        raise OutputError(str(path), f"is no report of palpate infer ({error})", "infer again") from error
    facts = [(name, report.get(name.lower().replace(" ", "_"))) for name in ("Strings", "Held out", "Networks")]
    facts += [("States", len(machine.transitions)), ("Symbols", ", ".join(map(shown_name, machine.alphabet)))]
    return Page(
        title=title,
        kind="an inferred automaton",
        facts=shown_facts(facts),
        sections=(automaton_section(machine), _choice(report, rows), _training(folder)),
        summary=tuple(rows),
    )


def _choice(report: dict[str, Any], rows: list[dict[str, Any]]) -> PageSection:
    head = ("q", "cells", "states, minimised", "wrong strings", "agreement", "loss [nats]")
    lines = tuple(tuple(_shown(row[name]) for name in _COLUMNS) for row in rows)
    text = f"Hidden space was cut into q intervals a unit; q = {report.get('q')} was taken."
    return PageSection("How fine to cut", (text,), (PageTable("What each q came to", head, lines),))


def _training(folder: Path) -> PageSection:
    captions = (
        ("training", "Lowest and median training loss of the networks, by step."),
        ("hidden", "Hidden states of the network at all prefixes of the strings, coloured by cell."),
    )
    pictures = tuple(
        Picture(name, words, words, read_png(folder / f"{name}.png"))
        for name, words in captions
        if is_there(folder / f"{name}.png")
    )
    return PageSection("Training", pictures=pictures)


def _shown(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4f}" if isinstance(value, float) else str(value)
