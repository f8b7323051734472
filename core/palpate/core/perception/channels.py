"""The measurement vector of the task: what the feature extractors are given once per decision.

========  =====  ==========================================================================
channel   unit   meaning
========  =====  ==========================================================================
x, y, z   m      position of the tool tip relative to the nominal goal
fx fy fz  N      force that the environment exerts on the tool, filtered
tx ty tz  N m    torque of the same wrench about the tool tip, filtered
========  =====  ==========================================================================

All of it in the task frame: right-handed, with its origin at the nominal goal.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isfinite
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from palpate.core.errors import CommandError, ConfigurationError

Matrix: TypeAlias = tuple[tuple[float, ...], ...]
Array: TypeAlias = npt.NDArray[np.float64]


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
    unknown = accepted is not None and not set(texts) <= set(accepted)
    if not texts or len(texts) != len(items) or len(set(texts)) != len(texts) or unknown:
        raise ConfigurationError(field, value, f"{wanted}, each only once")
    return texts


def samples(value: Iterable[Sequence[float]] | Array, columns: int | None = None) -> Array:
    """Two or more finite samples to fit something to, (n, columns); any width where none is asked for."""
    field = "perception.samples"
    accepted = f"two or more rows of {'equally many' if columns is None else columns} finite numbers"
    try:
        table = np.array(value if isinstance(value, np.ndarray) else list(value), dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ConfigurationError(field, value, accepted) from error
    if table.ndim != 2 or len(table) < 2 or table.shape[1] != (columns or max(1, table.shape[1])):
        raise ConfigurationError(field, f"shape {table.shape}", accepted)
    if not np.isfinite(table).all():
        raise ConfigurationError(field, "a value that is not finite", accepted)
    return table


def require_finite(what: str, values: Sequence[float]) -> None:
    """Refuse a measurement that is not finite."""
    if not isfinite(sum(values)):
        raise CommandError(f"{what} must be finite", values)


def _items(field: str, value: object, accepted: str) -> tuple[object, ...]:
    if isinstance(value, (str, bytes, dict)) or not isinstance(value, Iterable):
        raise ConfigurationError(field, value, accepted)
    return tuple(value)
