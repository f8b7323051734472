"""Help text for a command, generated from its declared options."""

import shutil
import textwrap
from collections.abc import Sequence
from inspect import getdoc
from typing import Any, Final, get_origin

import tyro

from palpate.adapters.config import RARE, Described, described, literal
from palpate.core.ports import OneOf, Range, kinds_of, optional_of, parts_of

_TEXT: Final = 20
"""Column at which the help texts begin."""
_MOST: Final = 15
"""Number of options above which the rare ones are described only by ``palpate settings``."""


def help_text(kind: type, command: str) -> str:
    """Return the help text for a command's options class."""
    wide = min(shutil.get_terminal_size().columns, 118)
    places, flags, rare = options_in(kind)
    heads = [place.name.upper() for place in places]
    words = [f"[{head}]" if place.default == "" else head for head, place in zip(heads, places, strict=True)]
    usage = " ".join((f"usage: palpate {command}", *words, *(["[OPTIONS]"] if flags else [])))
    parts = (getdoc(kind) or "").split("\n\n")
    wrapped = (part if part.startswith(" ") else textwrap.fill(" ".join(part.split()), wide) for part in parts)
    lines = [usage, "", "\n\n".join(wrapped), ""]
    lines += [_hanging(head, _text(place), wide) for head, place in zip(heads, places, strict=True)]
    lines += [_hanging(_head(flag), f"{_text(flag)}{_default(flag.default)}", wide) for flag in flags]
    if rare:
        more = ", ".join(flag_of(option) for option in rare)
        note = f"Further options, described by palpate settings {command}: {more}"
        lines += ["", textwrap.fill(note, wide, break_on_hyphens=False)]
    if "run" in kinds_of(kind):
        note = "Every other setting is a flag, too, such as --task.step-mm 0.5: palpate settings lists them."
        lines += ["", textwrap.fill(note, wide)]
    return "\n".join(lines) + "\n"


def options_in(kind: type) -> tuple[list[Described], list[Described], list[Described]]:
    """Return the positional arguments, the flags, and the flags that only ``palpate settings`` describes."""
    shared = {name for base in kind.__mro__[1:] for name in vars(base).get("__annotations__", {})}
    # A command's own options come before those that it shares with others.
    found = sorted(described(kind), key=lambda option: option.name in shared)
    places = [option for option in found if tyro.conf.Positional in _marks(option)]
    flags = [option for option in found if option not in places]
    rare = [flag for flag in flags if len(flags) > _MOST and (RARE in _marks(flag) or "." in flag.name)]
    return places, [flag for flag in flags if flag not in rare], rare


def flag_of(option: Described) -> str:
    """Return an option's flag; for a switch that is on by default, the flag turns it off."""
    table, dot, last = option.name.replace("_", "-").rpartition(".")
    return f"--{table}{dot}{'no-' if option.default is True else ''}{last}"


def _marks(option: Described) -> Sequence[Any]:
    return getattr(option.kind, "__metadata__", ())


def _head(flag: Described) -> str:
    base = parts_of(flag.kind)[0]
    base = parts_of(optional_of(base) or base)[0]
    if base is bool:
        return flag_of(flag)
    values = {int: "N", float: "X", str: "NAME"}
    return f"{flag_of(flag)} {'VALUE...' if get_origin(base) is tuple else values[base]}"


def _text(option: Described) -> str:
    base, (mark, *_) = parts_of(option.kind)[0], (*parts_of(option.kind)[1], None)
    text = f"Do not {option.text[:1].lower()}{option.text[1:]}" if option.default is True else option.text
    return f"{text}{_accepted(base, mark)}"


def _accepted(base: Any, mark: Any) -> str:
    if isinstance(mark, OneOf):
        return f" One of {', '.join(str(value) for value in mark.values if value != '')}."
    if isinstance(mark, Range) and not mark.text:
        return f" Accepts {mark.words(base)}."
    return ""


def _default(default: Any) -> str:
    return "" if default in (None, "", (), False, True, -1) else f" Default: {literal(default)}."


def _hanging(head: str, text: str, wide: int) -> str:
    indent = " " * _TEXT
    lines = textwrap.wrap(text, wide, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)
    if lines and len(head) + 2 < _TEXT - 1:
        lines[0] = f"  {head}".ljust(_TEXT) + lines[0].lstrip()
        return "\n".join(lines)
    return "\n".join((f"  {head}", *lines))
