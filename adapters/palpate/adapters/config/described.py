"""Descriptions of settings for listings and generated files: name, accepted values, unit, default and help."""

import ast
import inspect
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from itertools import pairwise
from textwrap import dedent
from typing import Any, Final

from palpate.core.ports import Settings, accepted_by, kinds_of, table_or

_UNITS: Final = {
    "mm": "mm", "m": "m", "deg": "degrees", "mrad": "mrad", "rad": "rad", "N": "N", "Nm": "N m", "kg": "kg", "s": "s",
    "ms": "ms", "us": "us", "Hz": "Hz", "kB": "kB", "bits": "bits", "N_per_mm": "N/mm", "Nm_per_rad": "N m/rad",
    "mm_per_s": "mm/s", "mm_s": "mm/s", "rad_s": "rad/s", "rad_s2": "rad/s^2", "N_s_per_m": "N s/m", "m_s": "m/s",
    "per_N_s": "1/(N s)", "m_per_N_s": "m/(N s)", "kgf_mm": "kgf mm", "m_s2": "m/s^2",
}  # fmt: skip
"""Units by name suffix."""


RARE: Final = "rare"
"""Marker for an option that ``palpate settings COMMAND`` describes and a long ``palpate COMMAND --help`` only lists."""


@dataclass(frozen=True, slots=True)
class Described:
    """A setting with its dotted name, type annotation, default (None if there is none) and help text."""

    name: str
    kind: Any
    default: Any
    text: str

    @property
    def accepted(self) -> str:
        """Accepted values as text."""
        return accepted_by(self.kind)

    @property
    def unit(self) -> str:
        """Unit given by the suffix in the name, or an empty string if there is none."""
        words = self.name.rpartition(".")[2].split("_")
        ends = ("_".join(words[place:]) for place in range(1, len(words)))
        return next((_UNITS[end] for end in ends if end in _UNITS), "")


def described(table: type[Settings], prefix: str = "") -> Iterator[Described]:
    """Yield every setting in a table and its subtables, in the order of declaration."""
    texts = texts_of(table)  # type: ignore[arg-type]
    for field in fields(table):  # type: ignore[arg-type]
        if not field.init:
            continue
        kind = kinds_of(table)[field.name]
        default = None if field.default is MISSING else field.default
        if field.default_factory is not MISSING:
            default = field.default_factory()
        name = f"{prefix}{field.name}"
        if isinstance(default, Settings) and table_or(kind) is None:
            # With this mark, the command-line parser merges a table's fields with those of the enclosing table.
            flat = any(getattr(mark, "name", None) == "" for mark in getattr(kind, "__metadata__", ()))
            yield from described(type(default), prefix if flat else f"{name}.")
        else:
            yield Described(name, kind, default, texts.get(field.name, ""))


@cache
def texts_of(table: type) -> Mapping[str, str]:
    """Return the docstring for each field in a class and its bases, on one line."""
    found: dict[str, str] = {}
    for base in reversed(table.__mro__[:-1]):
        (node,) = ast.parse(dedent(inspect.getsource(base))).body
        below = node.body if isinstance(node, ast.ClassDef) else []
        for field, text in pairwise(below):
            if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
                found[ast.unparse(field.target)] = " ".join(str(text.value.value).split())
    return found
