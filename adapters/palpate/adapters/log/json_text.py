"""JSON texts in messages of a log."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from palpate.core.errors import LogError

if TYPE_CHECKING:
    from palpate.adapters.log.reader import TrialLog


def dump_json(value: Any) -> str:
    """JSON in one line; floats keep every bit."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


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
    """The value for JSON: a number that is not finite, which JSON cannot hold, becomes None."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(inner) for inner in value]
    return value
