"""Strict JSON for declared tables, with one-line errors that give the location."""

import json
from typing import Any, NoReturn

from palpate.core.errors import ConfigurationError


def parse_json(text: str, whole: str, schema: str) -> dict[str, Any]:
    """Parse an object from strict JSON: no NaN, no infinity, no duplicate keys.

    Its ``schema`` must equal the argument. This is checked first, because the keys depend on the schema.

    Raises:
        ConfigurationError: The text is not such an object.
    """

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) != len(pairs):
            keys = [key for key, _ in pairs]
            repeated = next(key for key in keys if keys.count(key) > 1)
            raise ConfigurationError(whole, repeated, "each key once in its object")
        return found

    def refuse(name: str) -> NoReturn:
        raise ConfigurationError(whole, name, "finite numbers only")

    try:
        raw = json.loads(text, object_pairs_hook=once, parse_constant=refuse)
    except ConfigurationError:
        raise
    except (ValueError, RecursionError) as error:
        raise ConfigurationError(whole, text, f"JSON ({error})") from error
    if not isinstance(raw, dict):
        raise ConfigurationError(whole, raw, "an object")
    if (found := raw.get("schema")) != schema:
        ours = isinstance(found, str) and found.split("/")[0] == schema.split("/")[0]
        raise ConfigurationError("schema", found, repr(schema) if ours else f"{schema!r}: this is no {whole}")
    return raw
