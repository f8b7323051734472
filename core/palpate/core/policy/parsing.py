"""Typed reading of JSON values: whatever is wrong is one :class:`PolicyFileError` that says where."""

from __future__ import annotations

import json
from math import isfinite
from typing import Any, NoReturn

from palpate.core.errors import PolicyFileError


def parse_json(text: str) -> object:
    """Parse strict JSON: no NaN, no infinity, no key twice.

    Raises:
        PolicyFileError: It is not JSON.
    """
    try:
        return json.loads(text, object_pairs_hook=_without_repeats, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        if isinstance(error, PolicyFileError):
            raise
        raise PolicyFileError("policy file", text, f"JSON ({error})") from error


def plain_json(where: str, value: object) -> Any:
    """Copy of a value as it will come back from a JSON file.

    Raises:
        PolicyFileError: JSON cannot express it.
    """
    try:
        return json.loads(json.dumps(value, allow_nan=False))
    except (TypeError, ValueError, RecursionError) as error:
        raise PolicyFileError(where, value, f"values that JSON can express ({error})") from error


def read_object(where: str, value: object, keys: tuple[str, ...] | None = None) -> dict[str, Any]:
    """An object; with ``keys``, one that has exactly these."""
    if not isinstance(value, dict):
        raise PolicyFileError(where, value, "an object")
    if keys is not None and set(value) != set(keys):
        missing = [key for key in keys if key not in value]
        unknown = [key for key in value if key not in keys]
        problem = f"missing {', '.join(missing)}" if missing else f"unknown key {unknown[0]!r}"
        raise PolicyFileError(where, sorted(value), f"the keys {', '.join(keys)} ({problem})")
    return value


def read_list(where: str, value: object, length: int | None = None) -> list[Any]:
    """A list, of a given length if one is given."""
    if not isinstance(value, list) or (length is not None and len(value) != length):
        raise PolicyFileError(where, value, "a list" if length is None else f"a list of {length}")
    return value


def read_text(where: str, value: object) -> str:
    """A string."""
    if not isinstance(value, str):
        raise PolicyFileError(where, value, "a text")
    return value


def read_number(where: str, value: object) -> float:
    """A finite number."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = float("inf")
        if isfinite(number):
            return number
    raise PolicyFileError(where, value, "a finite number")


def read_count(where: str, value: object) -> int:
    """A whole number from 0 up."""
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise PolicyFileError(where, value, "a whole number from 0 up")
    return value


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        keys = [key for key, _ in pairs]
        repeated = next(key for key in keys if keys.count(key) > 1)
        raise PolicyFileError("policy file", repeated, "each key once in its object")
    return found


def _refuse_constant(name: str) -> NoReturn:
    raise PolicyFileError("policy file", name, "finite numbers only")
