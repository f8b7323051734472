"""JSON in logs, and about them."""

from __future__ import annotations

import json
import math
from typing import Any

from palpate.adapters.log.reader import TrialLog
from palpate.core.errors import LogError


def json_in(log: TrialLog, field: str, text: str) -> dict[str, Any]:
    """A JSON object that a message of a log holds as text; an empty one for no text.

    Raises:
        LogError: It is none.
    """
    try:
        found = json.loads(text) if text else {}
    except ValueError as error:
        raise LogError(log.path, field, f"is no JSON ({error})", "it was not written by palpate") from error
    if not isinstance(found, dict):
        raise LogError(log.path, field, "is no JSON object", "it was not written by palpate")
    return found


def finite(value: Any) -> Any:
    """The value for JSON: a number that is not finite, which JSON does not know, becomes None."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(inner) for inner in value]
    return value
