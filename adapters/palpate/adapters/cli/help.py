"""The help text of a command, from its declared options."""

import shutil
import textwrap
from dataclasses import MISSING, fields
from inspect import getdoc
from typing import Annotated, Any, Final, get_args, get_origin

import tyro

from palpate.adapters.config import literal, texts_of
from palpate.core.ports import OneOf, Range, kinds_of, parts_of

_TEXT: Final = 20
"""Column of the texts."""


def help_text(kind: type, command: str) -> str:
    """Return the help text of the options class of a command."""
    wide = min(shutil.get_terminal_size().columns, 118)
    named, flags = _entries(kind, wide)
    words = " ".join((f"palpate {command}", *(name for name, _ in named), "[OPTIONS]"))
    lines = [f"usage: {words}", "", _paragraphs(getdoc(kind) or "", wide), ""]
    lines += [text for _, text in (*named, *flags)]
    if "run" in kinds_of(kind):
        told = "Every other setting is a flag, too, such as --task.step-mm 0.5: palpate settings lists them."
        lines += ["", textwrap.fill(told, wide)]
    return "\n".join(lines) + "\n"


def _entries(kind: type, wide: int) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
    """Return positional arguments and flags, each with its name and text lines."""
    named, flags, texts = list[tuple[str, str]](), list[tuple[str, str]](), texts_of(kind)
    # What is the command's own comes before what it shares with others.
    for field in sorted(fields(kind), key=lambda one: one.name not in vars(kind).get("__annotations__", {})):
        annotation = kinds_of(kind)[field.name]
        marks = get_args(annotation)[1:] if get_origin(annotation) is Annotated else ()
        if any(getattr(mark, "name", None) == "" for mark in marks):
            more = _entries(get_args(annotation)[0], wide)
            named, flags = named + more[0], flags + more[1]
        elif field.init:
            base, (mark, *_) = parts_of(annotation)[0], (*parts_of(annotation)[1], None)
            default = field.default if field.default_factory is MISSING else field.default_factory()
            is_place = tyro.conf.Positional in marks
            flag = f"--{'no-' if default is True else ''}{field.name.replace('_', '-')}{_meta(base)}"
            head = field.name.upper() if is_place else flag
            text = f"{texts.get(field.name, '')}{_accepted(base, mark)}{'' if is_place else _default(default)}"
            entry = _hanging(head, text, wide)
            (named if is_place else flags).append((head, entry))
    return named, flags


def _meta(base: Any) -> str:
    if base is bool:
        return ""
    origin = get_origin(base)
    if origin is tuple:
        return " VALUE..."
    return {int: " N", float: " X"}.get(base, " NAME" if base is str else " N")


def _accepted(base: Any, mark: Any) -> str:
    if isinstance(mark, OneOf):
        return f" One of {', '.join(str(value) for value in mark.values if value != '')}."
    if isinstance(mark, Range) and not mark.text:
        return f" Accepts {mark.words(base)}."
    return ""


def _default(default: Any) -> str:
    if default is MISSING or default in (None, "", (), False, True, -1):
        return ""
    return f" Default: {literal(default)}."


def _paragraphs(text: str, wide: int) -> str:
    """Return the paragraphs of a docstring, wrapped unless they are indented."""
    parts = text.split("\n\n")
    return "\n\n".join(part if part.startswith(" ") else textwrap.fill(" ".join(part.split()), wide) for part in parts)


def _hanging(head: str, text: str, wide: int) -> str:
    indent = " " * _TEXT
    lines = textwrap.wrap(text, wide, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)
    if lines and len(head) + 2 < _TEXT - 1:
        lines[0] = f"  {head}".ljust(_TEXT) + lines[0].lstrip()
        return "\n".join(lines)
    return "\n".join((f"  {head}", *lines))
