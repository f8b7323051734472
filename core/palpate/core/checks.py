"""One-line checks of settings; each raises a ``ConfigurationError`` that says what would be accepted."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from palpate.core.errors import ConfigurationError


def require_in(field: str, value: float, low: float, high: float) -> None:
    """The value must be a finite number of [low, high]."""
    if not isinstance(value, (int, float)) or not isfinite(value) or not low <= value <= high:
        raise ConfigurationError(field, value, f"a number from {low:g} to {high:g}")


def require_whole(field: str, value: int, low: int, high: int) -> None:
    """The value must be a whole number of [low, high]."""
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise ConfigurationError(field, value, f"a whole number from {low} to {high}")


def require_one_of(field: str, value: str, accepted: Sequence[str]) -> None:
    """The value must be one of the names."""
    if value not in accepted:
        raise ConfigurationError(field, value, f"one of {', '.join(accepted)}")
