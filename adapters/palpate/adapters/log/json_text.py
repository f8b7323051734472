"""JSON text in log messages."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from palpate.core.errors import LogError

if TYPE_CHECKING:
    from palpate.adapters.log.reader import TrialLog


def dump_json(value: Any) -> str:
    """Return JSON on one line; floats keep all their bits."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


def json_in(log: TrialLog, field: str, text: str) -> dict[str, Any]:
    """Parse a JSON object from a string in a log; an empty string gives an empty object.

    Raises:
        LogError: The string is not a JSON object.
    """
    try:
        found = json.loads(text) if text else {}
    except ValueError as error:
        raise LogError(log.path, field, f"is not JSON ({error})", "it was not written by palpate") from error
    if not isinstance(found, dict):
        raise LogError(log.path, field, "is not a JSON object", "it was not written by palpate")
    return found


def finite(value: Any) -> Any:
    """Replace non-finite numbers with None, because JSON cannot represent them."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(inner) for inner in value]
    return value
