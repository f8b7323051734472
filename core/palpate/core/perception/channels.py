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

from collections.abc import Iterable, Sequence
from math import isfinite
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from palpate.core.errors import CommandError, ConfigurationError

Array: TypeAlias = npt.NDArray[np.float64]


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
