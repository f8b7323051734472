"""Values of plain JSON that stages and models are made of, checked one by one; and the kinds of stages."""

import dataclasses
from collections.abc import Iterable, Sequence
from math import isfinite
from typing import Any, Final, TypeAlias

import numpy as np

from palpate.core.errors import ConfigurationError

Matrix: TypeAlias = tuple[tuple[float, ...], ...]


def number(field: str, value: object, accepted: str = "a finite number") -> float:
    """A finite number; booleans are none."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise ConfigurationError(field, value, accepted)
    try:
        converted = float(value)
    except OverflowError as error:
        raise ConfigurationError(field, value, accepted) from error
    if not isfinite(converted):
        raise ConfigurationError(field, value, accepted)
    return converted


def integer(field: str, value: object, low: int, high: int = 2**32 - 1) -> int:
    """A whole number of [low, high]."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not low <= value <= high:
        raise ConfigurationError(field, value, f"a whole number from {low} to {high}")
    return int(value)


def vector(field: str, value: object, length: int | None = None) -> tuple[float, ...]:
    """Finite numbers, (length,); at least one where no length is asked for."""
    accepted = "a list of finite numbers" if length is None else f"a list of {length} finite numbers"
    items = _items(field, value, accepted)
    if not items or (length is not None and len(items) != length):
        raise ConfigurationError(field, value, accepted)
    return tuple(number(field, item, accepted) for item in items)


def matrix(field: str, value: object, columns: int, rows: int | None = None) -> Matrix:
    """Rows of finite numbers, (rows, columns); at least one where no number of rows is asked for."""
    items = _items(field, value, f"a list of rows of {columns} finite numbers")
    if not items or (rows is not None and len(items) != rows):
        raise ConfigurationError(field, value, f"{rows or 'one or more'} rows of {columns} finite numbers")
    return tuple(vector(field, row, columns) for row in items)


def names(field: str, value: object, accepted: Sequence[str] | None = None) -> tuple[str, ...]:
    """Names, at least one and each only once; of ``accepted``, where that is given."""
    wanted = "a list of names" if accepted is None else f"a list of names out of {', '.join(accepted)}"
    items = _items(field, value, wanted)
    texts = tuple(item for item in items if isinstance(item, str) and item)
    unknown = accepted is not None and any(text not in accepted for text in texts)
    if not texts or len(texts) != len(items) or len(set(texts)) != len(texts) or unknown:
        raise ConfigurationError(field, value, f"{wanted}, each only once")
    return texts


def _items(field: str, value: object, accepted: str) -> tuple[object, ...]:
    if isinstance(value, (str, bytes, dict)) or not isinstance(value, Iterable):
        raise ConfigurationError(field, value, accepted)
    return tuple(value)


STAGES: Final[dict[str, type[Any]]] = {}
"""Classes by the kind that a file names."""


def register_stage(kind: str, stage: type[Any]) -> None:
    """Let a further kind of stage be written and read.

    Args:
        stage: A dataclass whose constructor takes plain JSON values (or other stages) and checks them.

    Raises:
        ConfigurationError: The name belongs to another class, or it is not a dataclass.
    """
    if not dataclasses.is_dataclass(stage):
        raise ConfigurationError("perception.stage", stage, "a dataclass")
    if STAGES.setdefault(kind, stage) is not stage:
        raise ConfigurationError("perception.stage.kind", kind, "a name that is not taken")
